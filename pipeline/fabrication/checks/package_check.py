"""Checks a whole package before anyone gets to see it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import xarray as xr

from pipeline.fabrication.checks import (
    assembled_specimen,
    bill_checks,
    laser_folder,
    paper_checks,
    print_folder,
)
from pipeline.fabrication.checks.expected_parts import of_design
from pipeline.fabrication.checks.package_record import PackageRecord
from pipeline.fabrication.readback import Fault, read_meshes, stop
from pipeline.problem.sections import Fabrication

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
    assembled = read_meshes.read_stl(folder / "print/assembled.stl")
    found = assembled_specimen.shapes(assembled, wanted, asked)
    record = PackageRecord(folder, wanted, found, asked, paper_checks.letters(folder))
    faults: list[Fault] = []
    steps: Iterable[Iterator[Fault]] = (
        assembled_specimen.check_assembled(assembled, found, wanted, asked),
        print_folder.check(record),
        laser_folder.check(record),
        print_folder.check_fixtures(record),
        bill_checks.check(record),
        paper_checks.check(record),
    )
    for step in steps:
        faults += step
        done()
    stop([replace(fault, file=fault.file.relative_to(folder)) for fault in faults], pictures)


STEPS = 6
"""How often `check_package` tells of progress."""
