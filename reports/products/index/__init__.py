"""Lists all that was built on one page."""
