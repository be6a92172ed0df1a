"""Draws several studies side by side."""
