"""Reads the curves of all samples, thinned to even displacements, as arrays for the fit."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from pipeline.calibration.experiments import force_displacement
from pipeline.calibration.inputs import SampleTest, TestKind
from pipeline.calibration.population.curve_emulator import CurveEmulator
from pipeline.calibration.population.hierarchical_model import Readings
from pipeline.problem.sections import Lattice
from pipeline.runtime import UserError
from sim.core import Floats


class SampleCurve(NamedTuple):
    """Holds a curve as it was read."""

    name: str  # of the set
    test: TestKind  # its kind
    samples: tuple[str, ...]  # that it is the mean of
    displacement: Floats  # (n,) mm
    force: Floats  # (n,) N

    def ascending(self, points: int) -> Self:
        """Averages a curve that goes to and fro, or starts at zero, at so many displacements."""
        if self.displacement[0] > 0.0 and (np.diff(self.displacement) > 0.0).all():
            return self
        return self.thinned(float(self.displacement.max()), points)

    def thinned(self, end: float, points: int) -> Self:
        """Averages what was read about each of so many even displacements up to `end`, mm.

        The first half of the first step is left out: there the load cell's zero counts most.
        """
        near = np.rint(self.displacement / end * points).astype(int)
        kept = (near > 0) & (self.displacement <= end)
        count = np.bincount(near[kept], minlength=points + 1)
        displacement, force = (
            np.bincount(near[kept], values[kept], points + 1)[count > 0] / count[count > 0]
            for values in (self.displacement, self.force)
        )
        return self._replace(displacement=displacement, force=force)


def read_curve(asked: SampleTest, specimen: Lattice, folder: Path) -> SampleCurve:
    """Reads the curve of a set, which is of a specimen.

    Raises:
        UserError: the file cannot be used, or holds forces not above zero late on.
    """
    displacement, force = force_displacement.read(asked, specimen, folder)
    curve = SampleCurve(asked.name, asked.test, asked.samples, displacement, force)
    late = displacement > displacement.max() / 4
    check_forces(asked, folder, displacement[late], force[late])
    return curve


def check_forces(asked: SampleTest, folder: Path, displacement: Floats, force: Floats) -> None:
    """Refuses forces (n,), N, of a set that are not above zero; displacements (n,) are in mm.

    Raises:
        UserError: telling the first of them.
    """
    if (force > 0).all():
        return
    line = int(np.flatnonzero(~(force > 0))[0])
    raise UserError(
        "the force is not above zero where the test is on its way",
        file=folder / asked.file,
        key=asked.columns.force,
        value=f"{force[line]:g} N at {displacement[line]:g} mm",
        remedy="count displacement and force positive in the test's direction (record: reversed"
        " turns them), cut slack off at the start (record: toe), and the file where the test ends",
    )


def ends(curves: Sequence[SampleCurve]) -> dict[TestKind, float]:
    """Finds the largest displacement in mm that all curves of each kind of test reach."""
    kinds = dict.fromkeys(curve.test for curve in curves)
    return {
        kind: min(float(each.displacement.max()) for each in curves if each.test == kind)
        for kind in kinds
    }


def stack_readings(
    curves: Sequence[SampleCurve],
    emulators: Mapping[TestKind, CurveEmulator],
    samples: Sequence[str],
    points: int,
) -> tuple[Readings, list[list[str]]]:
    """Stacks the curves, kind by kind in the order of the emulators.

    Returns:
        the readings, all used, and by kind the name of the curve that each reading is of.
    """
    rows: list[list[tuple[SampleCurve, int]]] = []
    for kind, emulator in emulators.items():
        end = float(emulator.displacement[-1])
        thin = [each.thinned(end, points) for each in curves if each.test == kind]
        rows.append([(each, k) for each in thin for k in range(len(each.force))])
    size = max(map(len, rows))
    used = np.array([np.arange(size) < len(row) for row in rows], float)
    filled = [row + row[-1:] * (size - len(row)) for row in rows]
    displacement = np.array([[each.displacement[k] for each, k in row] for row in filled])
    force = np.array([[each.force[k] for each, k in row] for row in filled])
    shares = np.array(
        [
            [[(name in each.samples) / len(each.samples) for name in samples] for each, _ in row]
            for row in filled
        ]
    )
    made = list(emulators.values())
    weights = np.stack([one.weights(at) for one, at in zip(made, displacement, strict=True)])
    reach = np.array([one.displacement[-1] for one in made])
    readings = Readings(
        used,
        np.log(force),
        shares,
        displacement / reach[:, None],
        np.log(displacement),
        weights,
        made[0].centre,
    )
    return readings, [[each.name for each, _ in row] for row in rows]
