"""The virtual lab: films what is simulated, so that cameras and marks are tried before filming.

It films a study's own response, or a specimen that is off its design as those of labs are.
"""
