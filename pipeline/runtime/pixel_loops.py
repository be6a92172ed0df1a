"""Names the library of loops over pixels, and the type of a picture."""

from pathlib import Path

from sim.core import CLibrary, Image, Singles

Picture = Image | Singles
"""Brightness from 0 to 255, in steps of one or finer."""

_SUMS = ("-fassociative-math", "-fno-signed-zeros", "-freciprocal-math", "-ffp-contract=fast")
"""Lets the compiler reorder sums, which are the same on every run; NaN stays NaN."""

PIXEL_LOOPS = CLibrary(Path(__file__).resolve().parents[1], _SUMS)
compiled = PIXEL_LOOPS.compiled
