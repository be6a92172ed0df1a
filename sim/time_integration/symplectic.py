"""Integrates a network's motion explicitly, with its exact discrete adjoint."""

from typing import NamedTuple

from sim.core import Floats, Ints, compiled
from sim.energy import Bars, System, Workspace
from sim.time_integration.contact_substeps import Substeps


class Steps(NamedTuple):
    """Describes equal steps of a splitting."""

    n_steps: int  # number of steps
    h: float  # step, s
    splitting: Substeps  # coefficients of the flights, and of the substeps within them
    decay: Floats  # (n_kicks, n_dofs) of the kicks
    gain: Floats  # (n_kicks, n_dofs) of the kicks
    drive: Floats  # (n_steps, n_kicks, n_held) prescribed values at the kicks
    segment: int  # steps between checkpoints


class Outputs(NamedTuple):
    """Interpolates the outputs between the ends of a step."""

    interval: Ints  # (n_times,) step in which each output lies, ascending
    values: Floats  # (n_times, 4) weights of (u, u', v, v') in the displacement
    rates: Floats  # (n_times, 4) the same in the velocity


@compiled
def run(
    steps: Steps, outputs: Outputs, system: System, work: Workspace, watched: Ints,
    checkpoints: Floats, out_u: Floats, out_v: Floats, n_watched: int = 0,
) -> int:  # fmt: skip
    """Integrates from rest; fills outputs (n_times, n_dofs) and checkpoints.

    Checkpoints are (n_segments, 2, n_dofs) displacement and velocity. Contact of ``watched`` voids
    is that of the flights; the system must have none of its own.

    Returns:
        the step at which the motion left the admissible states, or -1.
    """


@compiled
def sweep_back(
    steps: Steps, outputs: Outputs, system: System, work: Workspace, watched: Ints,
    checkpoints: Floats, out_bar_u: Floats, out_bar_v: Floats, which: Ints, bars: Bars,
    bar_decay: Floats, bar_gain: Floats, n_watched: int = 0, n_which: int = 0,
) -> None:  # fmt: skip
    """Sweeps back through ``run`` from the loss derivatives by its outputs (n_times, n_dofs).

    Adds to ``bars``, but for damping and what mass does to the kicks: these enter through
    ``bar_decay`` and ``bar_gain``.
    """
