"""Names the library of all that this package defines in C."""

from pathlib import Path

from sim.core.c_library import CLibrary

LIBRARY = CLibrary(Path(__file__).resolve().parents[1])
compiled = LIBRARY.compiled
