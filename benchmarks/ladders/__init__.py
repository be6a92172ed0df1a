"""Run time against error: every method on every scene, at ever tighter settings."""
