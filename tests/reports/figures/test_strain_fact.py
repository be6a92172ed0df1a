"""The kind of strain that a drive puts on a lattice is named by its direction and its side."""

from pathlib import Path

import numpy as np
import pytest

from pipeline import problem
from reports.figures.loading_path.abscissa import Abscissa
from reports.figures.loading_path.facts import strain_facts
from tests.tables import cases

FIG4 = Path(__file__).parents[3] / "experiments/fig4/problem.yaml"
PATH = Abscissa("displacement", "u", "mm", np.array([0.0, 15.0]), True, None, (0, 1))


@cases("reports", "degrees, labels")
def test_a_drive_of_the_right_column_is_named(
    degrees: tuple[float, ...], labels: list[str]
) -> None:
    asked = problem.load(FIG4)
    drive = asked.drive.model_copy(update={"directions": tuple(np.radians(degrees))})
    found = list(strain_facts(asked.model_copy(update={"drive": drive}), PATH))
    assert [fact.label for fact in found] == labels
    assert [fact.value for fact in found] == pytest.approx([100 * 15.0 / 210.0] * len(found))
