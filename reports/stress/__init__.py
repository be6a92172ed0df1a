"""The page of the stress suite."""
