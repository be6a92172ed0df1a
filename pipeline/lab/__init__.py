"""The virtual lab: films simulated responses, so that cameras and marks are tried before filming.

A response of a perturbed design is filmed as any other: nothing here asks where one comes from.
"""
