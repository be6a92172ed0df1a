"""Shows a calibration: the fit beside the data, and what the data determine."""
