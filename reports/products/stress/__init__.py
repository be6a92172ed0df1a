"""Shows the counts of the stress suite."""
