"""Movies of the studies: structures side by side under their loads."""
