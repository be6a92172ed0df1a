"""The page over all that was built."""
