"""Report of structures along a path: a slowly growing load, or time."""
