"""Numbers that are none end in an error, by every integrator."""

from collections.abc import Callable

import numpy as np
import pytest

from sim.core import SimulationError
from sim.solvers import PrescribedMotion, Solver, TimeSeries, solve_case
from sim.time_integration import ExplicitSolver, ImplicitSolver
from tests.sim.structures import Rig
from tests.sim.time_integration.pulse import shaken

END = 0.012  # s


def explicit(rig: Rig) -> Solver:
    return ExplicitSolver(rig.topology, END, 200, np.linspace(0.0, END, 201))


def implicit(rig: Rig) -> Solver:
    times = np.linspace(0.0, END, 61)
    return ImplicitSolver(rig.topology, times, times, tolerance=1e-5)


@pytest.mark.parametrize("integrator", [explicit, implicit])
@pytest.mark.parametrize("broken", ["drive", "law", "void", "mass", "damping"])
def test_nan_never_leaves(broken: str, integrator: Callable[[Rig], Solver]) -> None:
    rig = shaken(1.0)
    values, drive = rig.values, rig.drive
    if broken == "drive":
        motion = np.array([[0.0] * 3, [np.nan] * 3, [0.0] * 3])
        drive = PrescribedMotion(rig.driven, TimeSeries(np.array([0.0, 0.006, END]), motion))
    else:
        bad = np.array(getattr(values, broken))
        bad.flat[20] = np.nan
        values = values._replace(**{broken: bad})
    with pytest.raises(SimulationError):
        solve_case(integrator(rig), values, drive)
