"""Draws Figure 3: several designs of one problem."""
