"""Tracks the units of a specimen through a video; knows nothing of the simulation."""
