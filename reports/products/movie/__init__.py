"""Renders movies of structures side by side under their loads."""
