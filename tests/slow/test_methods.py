"""The continuous adjoint of the baseline works, and comes to the discrete one."""

from benchmarks.harness import errors
from benchmarks.methods import selection


def test_the_continuous_adjoint_of_diffrax_comes_to_that_of_its_steps() -> None:
    every = {method.name: method for method in selection.methods("small_wave")}
    discrete, continuous = (
        every[name].prepare(1e-6, "gradient")().values
        for name in ("diffrax Tsit5", "diffrax Tsit5, backsolve")
    )
    found = errors(continuous, discrete)
    assert found["displacement"] == 0.0
    assert 0 < found["gradient"] < 1e-3
