"""Writes the headers by which C knows the types and functions of Python."""

import argparse
import importlib
import pkgutil

from pipeline.runtime import PIXEL_LOOPS, PREFIX
from sim.core import LIBRARY, CLibrary


def libraries() -> tuple[CLibrary, ...]:
    """Lists the libraries, with all that is declared in them."""
    for module in pkgutil.walk_packages([str(LIBRARY.folder)], f"{PREFIX}sim."):
        importlib.import_module(module.name)
    for name in _OVER_PIXELS:
        importlib.import_module(PREFIX + name)
    return LIBRARY, PIXEL_LOOPS


_OVER_PIXELS = (
    "pipeline.tracking.fit.patch_correlation",
    "pipeline.tracking.fit.template",
    "pipeline.tracking.fit.template_cells",
    "pipeline.virtual_lab.coverage",
)
"""Modules that declare loops over pixels."""


def work(_: argparse.Namespace) -> None:
    """Writes them."""
    for library in libraries():
        library.header_file.write_text(library.declarations(), encoding="utf-8")
