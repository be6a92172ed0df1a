"""Every method comes to the reference of another family, on lattices of 5 x 5 units."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from benchmarks.harness import Method, Run, errors
from benchmarks.methods import own_solvers, scipy_dynamics, scipy_statics, selection
from benchmarks.scenes import TITLES, LoadCase, case
from benchmarks.scenes.load_cases import scene
from sim.core import Floats
from sim.structure import VoidAngleContact

Found = dict[str, Floats]


@pytest.fixture(scope="module")
def reference() -> Found:
    return dict(selection.reference("small_push")()().values)


def missed(method: Method, value: float, task: str, reference: Found) -> dict[str, float]:
    run: Run = method.prepare(value, task)
    return errors(run().values, reference)


@pytest.mark.parametrize("name", ["fig2", "fig4", "fig5", "fig7"])
def test_scenes_have_the_law_that_all_methods_have(name: str) -> None:
    assert isinstance(scene(name).structure.contact, VoidAngleContact)


@pytest.mark.parametrize("way", [0, 1])
@pytest.mark.slow
def test_our_equilibria_and_gradients(way: int, reference: Found) -> None:
    method = own_solvers.at_rest("small_push", (1e-10,))[way]
    found = missed(method, 1e-10, "gradient", reference)
    assert found.keys() == {"displacement", "loss", "gradient", "slope"}
    assert np.max([*found.values()]) < 1e-9


@pytest.mark.slow
def test_differences_and_scipy_come_to_the_reference(reference: Found) -> None:
    found = missed(own_solvers.differences("small_push"), 1e-4, "gradient", reference)
    assert found["gradient"] < 1e-7
    splu = scipy_statics.at_rest("small_push", (1e-4,))[0]
    assert 0 < missed(splu, 1e-4, "loss", reference)["displacement"] < 1e-4


@pytest.mark.parametrize(
    ("name", "listed"),
    [("small_push", scipy_statics.at_rest), ("small_wave", scipy_dynamics.in_time)],
)
def test_scipy_compiles_nothing_while_it_is_timed(
    name: str,
    listed: Callable[[str, tuple[float, ...]], tuple[Method, ...]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    traced: list[str] = []
    measure = LoadCase.measure

    def counted(self: LoadCase, *given: Any) -> Any:  # noqa: ANN401
        traced.append(name)
        return measure(self, *given)

    monkeypatch.setattr(LoadCase, "measure", counted)
    case.cache_clear()
    run: Run = listed(name, (1e-3,))[0].prepare(1e-3, "loss")
    assert traced == [name]
    run()
    assert traced == [name]
    case.cache_clear()


@pytest.mark.parametrize("of", [selection.methods, selection.reference_described])
def test_every_scene_has_its_methods_and_reference(of: Callable[[str], object]) -> None:
    assert all(of(name) for name in TITLES)


def test_the_scenes_have_the_baselines_asked_for() -> None:
    waves = {method.name for method in selection.methods("fig2")}
    assert {"diffrax Tsit5", "diffrax Dopri5", "diffrax Kvaerno5"} < waves
    assert {"scipy Radau", "scipy BDF", "scipy DOP853", "central differences"} < waves
    pushes = {method.name for method in selection.methods("fig6")}
    assert {"pseudo-dynamics, Dopri5", "scipy newton_krylov", "Newton, fronts"} < pushes
