"""Figures of calibrations: the fit beside the data, and what the data determine."""
