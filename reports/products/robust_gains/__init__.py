"""Shows what robust designs gain over the study's own."""
