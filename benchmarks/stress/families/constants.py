"""Constants far from the paper's: stiffness ratios, damping, masses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.scenes import MATERIAL
from benchmarks.stress import (
    Check,
    StressCase,
    StressFamily,
    StressScene,
    equilibria,
    motions_as_advised,
    pressed,
    shaken,
    squares,
)
from sim.solvers import Harmonic

SIDE = 5
LOADS = np.array([0.5, 1.0])


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "constants",
        "each stiffness, and that of an inclusion, 1e-3 to 1e6 times the paper's; no damping to 1e9"
        " times the paper's; masses even and spread over 6 decades: pressed, shaken at 2 and 60 Hz",
        "balance by the definition, void angles by geometry, half the steps; tight where the"
        " default accuracy does not do, as its message or estimate of error says",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    for ratio in (1e3,) if small else 10.0 ** np.arange(-3, 7):
        for name, constants in _stiffness(float(ratio)):
            yield from _tried(f"{name} {ratio:.0e}", constants, stiff=True)
    for factor in (0.0,) if small else (0.0, 1e-3, 1e3, 1e6, 1e9):
        yield from _tried(f"damping times {factor:.0e}", _damping(factor))
    for seed in range(1 if small else 8):
        exponent = np.random.default_rng(seed).uniform(-3.0, 3.0, SIDE * SIDE)
        spread = {"density": MATERIAL.density * 10.0**exponent}
        yield from _tried(f"masses over 6 decades, draw {seed}", spread)
    for factor in () if small else (1e-3, 1e3, 1e6):
        yield from _tried(f"masses times {factor:.0e}", {"density": MATERIAL.density * factor})


def _stiffness(ratio: float) -> Iterator[tuple[str, dict[str, Any]]]:
    for name in ("axial", "shear", "bending", "contact"):
        yield f"{name} stiffness times", {name: getattr(MATERIAL, name) * ratio}
    units = squares(SIDE).ligament_units
    factor = np.where(np.isin(units, [6, 7, 11]).any(axis=1), ratio, 1.0)
    yield (
        "an inclusion of stiffness",
        {name: getattr(MATERIAL, name) * factor for name in ("axial", "shear", "bending")},
    )


def _damping(factor: float) -> dict[str, Any]:
    names = ("damping_translation", "damping_rotation")
    return {name: getattr(MATERIAL, name) * factor for name in names}


def _tried(name: str, constants: dict[str, Any], stiff: bool = False) -> Iterator[StressCase]:
    """A structure of these constants pressed, and shaken slowly and fast."""
    if stiff:
        plate = pressed(squares(SIDE), 0.08).with_material(**constants)
        yield StressCase(f"{name}, pressed", partial(equilibria, plate, LOADS))
    for frequency, duration in ((2.0, 0.25), (60.0, 0.02)):
        motion = Harmonic(2.0, frequency, 0.8)
        case = shaken(squares(SIDE), motion, duration=duration, frequency=frequency)
        made = case.with_material(**constants)
        yield StressCase(f"{name}, shaken at {frequency:g} Hz", partial(_shaken, made))


def _shaken(case: StressScene) -> Sequence[Check]:
    return motions_as_advised(case, np.linspace(0.0, case.scene.loads.duration, 26), 0.05)
