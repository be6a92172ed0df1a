"""Checks a whole package before anyone gets to see it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import xarray as xr

from pipeline.fabrication.checks.assembled_specimen import check_assembled, unit_sections
from pipeline.fabrication.checks.bill_checks import check_bill
from pipeline.fabrication.checks.laser_folder import check_laser
from pipeline.fabrication.checks.package_record import PackageRecord, expected_parts
from pipeline.fabrication.checks.paper_checks import check_papers
from pipeline.fabrication.checks.print_folder import check_fixtures, check_print
from pipeline.fabrication.papers import read_manifest
from pipeline.fabrication.readback import Fault, read_stl, stop
from pipeline.problem.sections import Fabrication

STEPS = 6
"""Number of calls of `done` by `check_package`."""


def check_package(
    folder: Path,
    design: xr.Dataset,
    structure: str,
    settings: Fabrication,
    pictures: Path,
    done: Callable[[], object] = lambda: None,
) -> None:
    """Reads every file of a package back and stops at faults.

    Args:
        folder: the package.
        design: the dataset that it was made of.
        structure: intact, altered or cloaked.
        settings: of the fabrication.
        pictures: folder for pictures of faults; made only if there are any.
        done: called after each of the STEPS.

    Raises:
        UserError: the first fault, with its unit, the parameter to change and a picture.
    """
    expected = expected_parts(design, structure)
    assembled = read_stl(folder / "print/assembled.stl")
    shapes = unit_sections(assembled, expected, settings)
    letters = dict(read_manifest(folder)["letters_for_ids"])
    record = PackageRecord(folder, expected, shapes, settings, letters)
    faults: list[Fault] = []
    steps: Iterable[Iterator[Fault]] = (
        check_assembled(assembled, record),
        check_print(record),
        check_laser(record),
        check_fixtures(record),
        check_bill(record),
        check_papers(record),
    )
    for step in steps:
        faults += step
        done()
    stop([replace(fault, file=fault.file.relative_to(folder)) for fault in faults], pictures)
