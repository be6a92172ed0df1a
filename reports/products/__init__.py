"""Builds the pages of what is not a figure: packages, tracks, sweeps, movies."""
