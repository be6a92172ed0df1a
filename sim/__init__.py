"""Physics of networks of rigid units joined by elastic ligaments.

Pure functions on arrays: no files, no configuration, no plotting. Units throughout: mm, N, s,
tonne, rad, float64.
"""
