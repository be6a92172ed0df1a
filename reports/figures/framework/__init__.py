"""Draws Figure 1: the framework as a schematic."""
