"""Draws measured specimens beside their prediction."""
