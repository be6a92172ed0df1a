"""Lists the files that a calibration is made from."""

from pathlib import Path

from pipeline import problem
from pipeline.calibration.inputs.description import Calibration, TrackedMotion
from pipeline.problem.fields import named_files


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
