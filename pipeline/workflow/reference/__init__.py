"""Writes the pages of keys and datasets from their definitions."""
