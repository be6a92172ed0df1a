"""Report of structures that waves run through."""
