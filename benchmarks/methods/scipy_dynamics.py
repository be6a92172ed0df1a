"""Lists scipy's integrators as methods, and the reference solution by one of them.

The right-hand side is the project's compiled force, called from Python at every stage.
"""

from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.integrate import solve_ivp

from benchmarks.harness import Method, Run, Sample, Task, settings_of
from benchmarks.methods.own_solvers import gradient_of
from benchmarks.scenes import LoadCase, case
from sim.core import Floats
from sim.energy import gradient, kinematics_of, system_of
from sim.solvers import Harmonic
from sim.structure import ConcreteParameters
from sim.vibration import linearised

IMPLICIT = ("Radau", "BDF")
REFERENCE, TIGHT = "DOP853", 1e-11
APART = 3e-4
"""Distance in the design (mm) of the two runs whose difference is the reference slope."""


class FirstOrderSystem:
    """Integrates the free dofs of a harmonically driven case in time, y = (u, v), for scipy."""

    def __init__(self, posed: LoadCase, values: ConcreteParameters) -> None:
        scene = posed.scene
        (drive,) = scene.loads.motions
        assert isinstance(drive, Harmonic)
        self.topology, self.values, self.drive = scene.topology, values, drive
        self.free = np.sort(self.topology.free_dofs)
        driven = 3 * scene.loads.driven
        self._along_x, self._along_y = driven, driven + 1
        self._system = system_of(self.topology, values)
        self._kinematics = kinematics_of(self._system)
        self._force = np.empty(self.topology.n_dofs)
        self.mass = values.mass.ravel()[self.free]
        self.damping = values.damping.ravel()[self.free]

    def all_dofs(self, time: float, free: Floats) -> Floats:
        """Returns all dofs (n_dofs,) at a time."""
        motion = np.zeros(self.topology.n_dofs)
        motion[self.free] = free
        moved = _harmonic(self.drive, time)
        motion[self._along_x] = moved * np.cos(self.drive.direction)
        motion[self._along_y] = moved * np.sin(self.drive.direction)
        return motion

    def rates(self, time: float, state: Floats) -> Floats:
        """Computes velocities and accelerations (2 n_free,)."""
        u, v = np.split(state, 2)
        gradient(self.all_dofs(time, u), self._system, self._kinematics, self._force)
        return np.concatenate([v, -(self._force[self.free] + self.damping * v) / self.mass])

    def jacobian(self, time: float, state: Floats) -> sp.csc_array:
        """Computes the derivative (2 n_free, 2 n_free) of the rates."""
        motion = self.all_dofs(time, np.split(state, 2)[0]).reshape(-1, 3)
        stiffness = linearised(self.topology, self.values, motion).stiffness
        slow, one = sp.diags_array(-self.damping / self.mass), sp.eye_array(len(self.free))
        return sp.csc_array(
            sp.block_array([[None, one], [-sp.diags_array(1 / self.mass) @ stiffness, slow]])
        )


def _harmonic(drive: Harmonic, time: float) -> float:
    shifted = time - drive.delay
    wave = drive.amplitude * np.sin(2 * np.pi * drive.frequency * shifted)
    rising = 1.0 if drive.rise is None else (1 + np.tanh(shifted / drive.rise)) / 2
    return float(wave * rising)


def in_time(name: str, tolerances: tuple[float, ...]) -> tuple[Method, ...]:
    """Lists the explicit method and the two implicit ones; they have no gradient."""
    made = {method: partial(_prepare, name, method) for method in (REFERENCE, *IMPLICIT)}
    settings = settings_of(tolerances)
    return tuple(
        Method(f"scipy {key}", run, settings, False, ("loss",)) for key, run in made.items()
    )


def _prepare(name: str, method: str, tolerance: float, _: Task) -> Run:
    posed = case(name)
    system, rest = FirstOrderSystem(posed, posed.values), np.zeros(2 * posed.scene.topology.n_free)

    def run() -> Sample:
        motion, work = _solve(posed, posed.values, method, tolerance)
        return Sample(posed.results(*posed.measured(motion, posed.values)), work)

    system.rates(0.0, rest)
    system.jacobian(0.0, rest)
    posed.compile_measures()
    return run


def _solve(
    posed: LoadCase, values: ConcreteParameters, method: str, tolerance: float
) -> tuple[Floats, dict[str, int]]:
    """Computes the motion (1, n_times, n_units, 3), and counts."""
    motion = FirstOrderSystem(posed, values)
    start, span = np.zeros(2 * len(motion.free)), (0.0, posed.scene.loads.duration)
    more: dict[str, Any] = {"rtol": tolerance, "atol": tolerance, "t_eval": posed.times}
    more |= {"jac": motion.jacobian} if method in IMPLICIT else {}
    found = solve_ivp(motion.rates, span, start, method=method, **more)
    if not found.success:
        raise ArithmeticError(found.message)
    states = [
        motion.all_dofs(t, y[: len(motion.free)]) for t, y in zip(found.t, found.y.T, strict=True)
    ]
    work = {"forces": int(found.nfev), "factorisations": int(found.nlu)}
    return np.stack(states).reshape(1, len(states), -1, 3), work


def reference(name: str) -> Run:
    """Prepares motion, loss, slope by DOP853 at 1e-11; the gradient by our tightest adjoint."""
    posed = case(name)

    def loss(design: Floats) -> tuple[Floats, Floats]:
        values = posed.values_of(design)
        motion, _ = _solve(posed, values, REFERENCE, TIGHT)
        return np.asarray(posed.objective(motion, values)[0]), motion

    def run() -> Sample:
        centre, motion = loss(0 * posed.direction)
        ahead, behind = (loss(sign * APART * posed.direction)[0] for sign in (1, -1))
        found = posed.results(centre, motion)
        slope = (ahead - behind) / (2 * APART)
        return Sample(found | {"slope": slope, "gradient": gradient_of(posed)}, {})

    return run
