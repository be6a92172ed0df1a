"""Shows what survived damage, kills and full disks."""
