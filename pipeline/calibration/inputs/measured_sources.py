"""Lists the files that a calibration is made from, and tells whether any is of computed data."""

from collections.abc import Iterable
from pathlib import Path

from pipeline import datasets, problem
from pipeline.calibration.inputs.description import Calibration, MeasurementSet, TrackedMotion
from pipeline.calibration.inputs.load_cycles import CycleRecord
from pipeline.calibration.inputs.population import SampleTest
from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.problem.fields import csv_columns, named_files


def source_files(asked: Calibration, folder: Path) -> dict[str, Path]:
    """Lists the files that a calibration in a folder names, and those of its tracks' problems.

    By their keys joined by dots; those that a problem names stand below the key of its file.

    Raises:
        UserError: a problem cannot be read.
    """
    found = named_files(asked, folder)
    for number, each in enumerate(asked.data):
        if isinstance(each, TrackedMotion):
            path = folder / each.problem
            below = named_files(problem.load(path, each.preset), path.parent)
            found |= {
                f"data.{number}.problem.{key}": file
                for key, file in below.items()
                if not key.startswith("report.")  # of pages alone
            }
    return found


def has_synthetic(sets: Iterable[MeasurementSet | SampleTest | CycleRecord], folder: Path) -> bool:
    """Tests whether any set in a folder was rendered or computed: its track or CSV says so.

    Raises:
        UserError: a file cannot be read.
    """
    return any(_is_synthetic(each, folder / each.file) for each in sets if each.file is not None)


def _is_synthetic(each: MeasurementSet | SampleTest | CycleRecord, path: Path) -> bool:
    if isinstance(each, TrackedMotion) or path.suffix == ".nc":
        return datasets.read_attributes(path).get("synthetic") == "yes"
    return any(SYNTHETIC_LABEL in line for line in csv_columns.read_preamble(path))
