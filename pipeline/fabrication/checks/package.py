"""Checks a whole package before anyone gets to see it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import xarray as xr

from pipeline.fabrication.checks import bill, cutting, papers, placed, printing, solids
from pipeline.fabrication.checks.faults import Fault, stop
from pipeline.fabrication.checks.record import Record
from pipeline.fabrication.checks.wanted import of_design
from pipeline.problem.fabrication import Fabrication

Done = Callable[[], object]


def check_package(
    folder: Path,
    design: xr.Dataset,
    structure: str,
    asked: Fabrication,
    pictures: Path,
    done: Done = lambda: None,
) -> None:
    """Reads every file of a package back and stops at faults.

    Args:
        folder: the package.
        design: the dataset that it was made of.
        structure: intact, altered or cloaked.
        asked: the parameters of fabrication.
        pictures: folder for pictures of faults; made only if there are any.
        done: called after each of the STEPS.

    Raises:
        UserError: the first fault, with its unit, the parameter to change and a picture.
    """
    wanted = of_design(design, structure)
    assembled = solids.read_stl(folder / "print/assembled.stl")
    found = placed.shapes(assembled, wanted, asked)
    record = Record(folder, wanted, found, asked, papers.letters(folder))
    faults: list[Fault] = []
    steps: Iterable[Iterator[Fault]] = (
        placed.check_assembled(assembled, found, wanted, asked),
        printing.check(record),
        cutting.check(record),
        printing.check_fixtures(record),
        bill.check(record),
        papers.check(record),
    )
    for step in steps:
        faults += step
        done()
    stop([replace(fault, file=fault.file.relative_to(folder)) for fault in faults], pictures)


STEPS = 6
"""How often `check_package` tells of progress."""
