"""Selects the methods and the reference of a scene."""

from collections.abc import Callable
from functools import partial

from benchmarks.harness import Method, Run
from benchmarks.methods import diffrax_methods, own_solvers, scipy_dynamics, scipy_statics

IN_TIME = ("fig2", "fig7", "small_wave")
BY_DIFFERENCES = ("fig2", "fig4", "small_wave", "small_push")
"""Scenes small enough for a gradient by differences."""
_IN_WORDS = {
    True: (
        "displacement, loss and slope (central differences of the loss): scipy DOP853 at rtol ="
        " atol = 1e-11; gradient: adjoint of the explicit method of order 4 at a quarter of a"
        " stable step, checked by that slope"
    ),
    False: (
        "Newton's method with SuperLU to 1e-11 of the largest reaction; gradient by JAX's"
        " derivatives of the law"
    ),
}


def methods(name: str) -> tuple[Method, ...]:
    """Lists all methods on a scene."""
    made = _in_time(name) if name in IN_TIME else _at_rest(name)
    return (*made, own_solvers.differences(name)) if name in BY_DIFFERENCES else made


def _in_time(name: str) -> tuple[Method, ...]:
    small = name.startswith("small")
    return (
        *own_solvers.in_time(name, 2 if small else 4),
        *diffrax_methods.in_time(name, (1e-4, 1e-6) if small else (1e-4, 1e-6, 1e-8)),
        *scipy_dynamics.in_time(name, (1e-4, 1e-6) if small else (1e-3, 1e-5, 1e-7, 1e-9)),
    )


def _at_rest(name: str) -> tuple[Method, ...]:
    small = name.startswith("small")
    return (
        *own_solvers.at_rest(
            name, (1e-4, 1e-10) if small else (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
        ),
        *diffrax_methods.at_rest(name, (20.0,) if small else (350.0, 1000.0, 3500.0)),
        *scipy_statics.at_rest(name, (1e-4, 1e-8) if small else (1e-4, 1e-6, 1e-8, 1e-10)),
    )


def reference(name: str) -> Callable[[], Run]:
    """Returns what prepares the reference of a scene, in a process of its own."""
    return partial(scipy_dynamics.reference if name in IN_TIME else scipy_statics.reference, name)


def reference_described(name: str) -> str:
    """Describes the reference of a scene."""
    return _IN_WORDS[name in IN_TIME]
