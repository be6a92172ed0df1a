from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from time import sleep

import numpy as np
import pytest

from sim.constraints import Limits
from sim.core import Floats, SimulationError
from sim.load_family import (
    FamilyOptions,
    FoundLoad,
    LoadFamily,
    LoadLosses,
    LoadSetup,
    SearchOptions,
    ascend,
    directed,
    exchange,
    minimise_worst,
    spread_places,
)
from sim.load_family.exchange import IDLE, LoadSearch, LoadSet, without_copies
from sim.load_family.family_losses import LoadLoss
from sim.load_family.worst_load import search_worst
from sim.optimise import Evaluation, Journal, Result, SqpOptions, minimise
from sim.scene import Clamp, Scene, parameters_of_copies, parameters_of_design, simulate
from sim.solvers import DISPLACEMENT, FREE, Harmonic, LinearRamp, PrescribedMotion, Superposition
from sim.structure import Perturbation, draw_copies
from tests.sim.scene.test_plan import design_of, scene
from tests.sim.structures import central
from tests.tables import some

SHAKING = LoadSetup(Harmonic(3.0, 5.0, 0.0), (0.0, np.pi), (1.0, 3.0), (2.0, 16.0))
PUSHING = LoadSetup(LinearRamp(3.0, 0.2), (0.0, np.pi), (1.0, 3.0))
SHAKEN, PUSHED = LoadFamily((SHAKING,)), LoadFamily((PUSHING,))


def mimicked() -> Scene:
    """Pushed along any direction, with a void whose surroundings are to move as without it."""
    intact = scene(motions=(PUSHING.motion,), static=True, steps=3)
    lattice = intact.lattice.without(np.array([8]))
    region = lattice.positions(intact.lattice.id[intact.objective.region])
    units = lattice.positions(np.array([24]))
    return intact.updated(
        lattice=lattice,
        cases=tuple(case._replace(units=units) for case in intact.loads.cases),
        supports=tuple(
            type(each)(lattice.positions(each.units), each.dofs) for each in intact.loads.supports
        ),
        region=region,
        cloak=lattice.positions(intact.design.cloak[intact.design.cloak != 8]),
        reference=intact,
    )


def in_two_setups() -> tuple[LoadFamily, Scene]:
    """Pushed at the middle, or held at two corners and pushed by two others along x and y."""
    held = mimicked()
    ramps = LinearRamp(3.0, 0.2), LinearRamp(4.0, 0.2, np.pi / 2)

    def other(of: Scene) -> Scene:
        corners = of.lattice.positions(np.array([0, 6, 42, 48]))
        control = np.array([[DISPLACEMENT, FREE, DISPLACEMENT], [FREE, DISPLACEMENT, DISPLACEMENT]])
        drive = PrescribedMotion(corners[1:3], Superposition(ramps, np.eye(2)), control)
        reference = of.objective.reference
        return of.updated(
            cases=(drive,),
            supports=(Clamp(corners[[0, 3]]),),
            reference=reference and other(reference),
        )

    mixed = LoadSetup(Superposition(ramps, np.eye(2)), (0.5, 1.5), (1.0, 6.0), scene=other(held))
    return LoadFamily((PUSHING, mixed)), held


@pytest.mark.slow
def test_a_mixture_is_a_direction_among_two_motions() -> None:
    family, posed = in_two_setups()
    mixed = family.setups[1]
    place = mixed.place(mixed.motion)
    np.testing.assert_allclose(mixed.numbers(place), [np.arctan2(4, 3), 5.0])
    at = family.centred(np.array([0.2, 0.6, 0.9]))
    np.testing.assert_array_equal(at, [0.2, 0.6, 0.75])
    np.testing.assert_allclose(
        family.numbers(np.stack([at, 0.4 * at])), [[0.7, 4.0], [0.08 * np.pi, 1.48]]
    )
    moved = directed(mixed.motion, 0.7, 4.0)
    under = mixed.posed(posed).under((moved,), 0.2, None)
    design = design_of(posed, 0.2)
    found = LoadLosses(posed, family, parameters_of_design(posed)).value(design, at)
    vertices = np.asarray(posed.space.vertices(design))
    assert found == pytest.approx(float(simulate(under, vertices=vertices).loss), rel=1e-9)


@pytest.mark.parametrize("place", [(0.1, 0.7, 0.95), (0.4, 1.0, 0.3)])
def test_the_loss_in_scaled_time_is_that_of_the_load(place: tuple[float, float, float]) -> None:
    posed, at = scene(), np.array(place)
    design = design_of(posed)
    angle, amplitude, frequency = (float(number) for number in SHAKEN.numbers(at))
    load = Harmonic(amplitude, frequency, angle)
    np.testing.assert_allclose(SHAKEN.place(load), at, atol=1e-12)
    direct = posed.under((load,), 1 / frequency, frequency, integrator="implicit")
    assert posed.loads.duration * 5.0 == 1.0  # of one period
    found = LoadLosses(posed, SHAKEN, parameters_of_design(posed)).value(design, at)
    assert found == pytest.approx(float(simulate(direct, design).loss) * 9 / amplitude**2, rel=4e-3)


@pytest.mark.parametrize(("family", "posed"), some([(SHAKEN, scene), (PUSHED, mimicked)], 1))
def test_derivatives_by_the_design_and_by_the_load(family: LoadFamily, posed: object) -> None:
    made: Scene = posed()  # type: ignore[operator]
    losses = LoadLosses(made, family, parameters_of_design(made))
    design, at = design_of(made, 0.2), np.array([0.3, 0.6, 0.9][: family.size])
    check_derivatives(losses, design, at)


@pytest.mark.slow
def test_imperfect_copies_count_by_their_p_mean() -> None:
    made = scene()
    copies = draw_copies(made.lattice, Perturbation(0.3, 0.1), 2, 0)
    made = made.updated(copies=copies, copy_sharpness=4.0)
    maps, design, at = parameters_of_copies(made), design_of(made, 0.2), np.array([0.3, 0.6, 0.9])
    each = [LoadLosses(made, SHAKEN, of_copy).value(design, at) for of_copy in maps]
    losses = LoadLosses(made, SHAKEN, *maps)
    assert losses.value(design, at) == pytest.approx(np.mean(np.power(each, 4)) ** 0.25, rel=1e-12)
    assert abs(each[0] - each[1]) > 1e-3 * each[0]
    check_derivatives(losses, design, at)


def test_derivatives_in_another_setup() -> None:
    family, posed = in_two_setups()
    losses = LoadLosses(posed, family, parameters_of_design(posed))
    check_derivatives(losses, design_of(posed, 0.2), np.array([0.3, 0.6, 0.75]))


def check_derivatives(losses: LoadLosses, design: Floats, at: Floats) -> None:
    found = losses(design, at)
    assert found.value == pytest.approx(losses.value(design, at), rel=1e-13)
    way = found.by_design / np.linalg.norm(found.by_design)
    slopes = [central(lambda h: losses.value(design + h * way, at), 1e-5)]
    steps = np.eye(len(at))
    slopes += [*central(lambda h: [losses.value(design, at + h * e) for e in steps], 1e-5)]
    exact = [float(found.by_design @ way), *found.by_place]
    assert slopes == pytest.approx(exact, rel=1e-4, abs=1e-6)


def test_octaves_count_from_the_highest_frequency() -> None:
    frequencies = (16.0, 15.9, 8.0, 7.9, 2.0)
    places = [SHAKEN.place(Harmonic(2.0, f, 0.5)) for f in frequencies]
    assert [SHAKING.octave(place) for place in places] == [0, 0, 1, 1, 3]
    switched = LoadSetup(Harmonic(1.0, 4.0, rise=0.2, delay=0.5), (0, 1), (1, 2), (1.0, 16.0))
    fastest = switched.fastest(1)
    assert isinstance(fastest, Harmonic)
    assert fastest == Harmonic(2.0, 8.0, 0.0, rise=0.1, delay=0.25)


def test_threads_share_the_octave_that_one_of_them_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    class Slow:
        def __init__(self, *_: object) -> None:
            made.append(self)
            sleep(0.05)

        def loss(self, *_: object) -> float:
            return float(made.index(self))

    monkeypatch.setattr("sim.load_family.family_losses._Octave", Slow)
    losses = LoadLosses(scene(), SHAKEN, parameters_of_design(scene()))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: losses.value(np.zeros(1), np.full(3, 0.5)), range(4)))
    assert found == [0.0] * 4
    assert len(made) == 1


def bell(place: Floats) -> tuple[float, Floats]:
    """Two hills; the higher one, of height 2, at (0.8, 0.7)."""
    value, slope = 0.0, np.zeros(2)
    for height, top in ((1.0, (0.2, 0.2)), (2.0, (0.8, 0.7))):
        off = place - np.array(top)
        hill = height * np.exp(-20 * off @ off)
        value, slope = value + hill, slope - 40 * hill * off
    return float(value), slope


def test_the_search_finds_the_highest_of_several_hills() -> None:
    options = SearchOptions(samples=16, ascents=3, evaluations=20)
    found = search_worst(lambda at: bell(at)[0], bell, PUSHED, options)
    assert len(found) == 3
    assert found[0].loss == pytest.approx(2.0, abs=1e-3)
    np.testing.assert_allclose(found[0].place, [0.8, 0.7], atol=1e-2)


def test_a_load_that_one_search_misses_is_found_by_another() -> None:
    """Beyond a snap, where losses jump, no gradient leads."""

    class Snapping(LoadLosses):
        def __init__(self) -> None:
            self.family = PUSHED

        def value(self, _: Floats, place: Floats) -> float:
            return 2.0 if np.abs(place - [0.2, 0.95]).max() < 0.06 else 1.0

        def __call__(self, _: Floats, place: Floats) -> LoadLoss:
            return LoadLoss(self.value(_, place), np.zeros(0), np.zeros(2))

    search = LoadSearch(Snapping(), lambda evaluate: evaluate, SearchOptions())
    found = [search(np.zeros(1))[0].loss for _ in range(8)]
    assert found[0] == 1.0
    assert max(found) == 2.0


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_a_search_does_not_depend_on_the_unit_of_the_loss(unit: float) -> None:
    def scaled(place: Floats) -> tuple[float, Floats]:
        value, slope = bell(place)
        return unit * value, unit * slope

    start = np.array([0.45, 0.2])
    found, expected = ascend(scaled, start, 30), ascend(bell, start, 30)
    assert found.loss == pytest.approx(unit * expected.loss, rel=1e-9)
    assert np.abs(expected.place - start).max() > 0.05  # it does search
    np.testing.assert_allclose(found.place, expected.place, atol=1e-6)


def test_a_load_that_cannot_be_simulated_is_avoided(caplog: pytest.LogCaptureFixture) -> None:
    def half(place: Floats) -> tuple[float, Floats]:
        if place[0] > 0.75:
            raise SimulationError("no step is short enough")
        return bell(place)

    found = ascend(half, np.array([0.6, 0.6]), 20)
    assert bell(np.array([0.6, 0.6]))[0] < found.loss < 2.0
    assert found.place[0] <= 0.75
    assert "no step is short enough" in caplog.text


def test_places_are_spread_alike_and_copies_left_out() -> None:
    places = spread_places(SHAKEN, 11, 3)
    np.testing.assert_array_equal(places, spread_places(SHAKEN, 11, 3))
    assert places.shape == (11, 3)
    assert places.min() >= 0.0
    assert (np.histogram(places[:, 0], 2, (0, 1))[0] >= 4).all()
    folded = without_copies(SHAKEN, scene().updated(symmetry="C4"))
    assert folded.setups[0].direction == (0.0, np.pi / 2)
    assert without_copies(SHAKEN, scene()) == SHAKEN


def test_equal_loads_have_one_place() -> None:
    """Of numbers that are single values, and of set-ups."""
    steady = replace(SHAKING, direction=(0.0, 0.0), amplitude=(3.0, 3.0))
    places = spread_places(LoadFamily((steady,)), 8, 0)
    assert (places[:, :2] == 0.0).all()
    assert len(np.unique(places[:, 2])) == 8
    both = spread_places(LoadFamily((steady, SHAKING)), 8, 0)
    assert (both[both[:, 3] == 0.25, :2] == 0.0).all()
    assert (both[both[:, 3] == 0.75, :2] > 0.0).all()


def test_a_load_leaves_the_set_when_it_did_no_harm_for_long() -> None:
    posed = scene(samples=21, accuracy="draft")
    losses = LoadLosses(posed, SHAKEN, parameters_of_design(posed))
    held = LoadSet(losses, posed, FamilyOptions())
    one, other = np.full(3, 0.2), np.full(3, 0.9)
    held.exchange(np.zeros(0), [FoundLoad(one, 1.0, one), FoundLoad(one + 0.01, 0.9, one)])
    np.testing.assert_array_equal(held.added, [one])
    held.exchange(np.array([0.1]), [FoundLoad(other, 1.0, one)])
    for _ in range(IDLE - 1):
        np.testing.assert_array_equal(held.added, [one, other])
        held.exchange(np.array([0.1, 1.0]), [FoundLoad(other, 1.0, one)])
    np.testing.assert_array_equal(held.added, [other])


def minimised(
    journal: Journal | None = None,
    callback: Callable[[Evaluation], None] | None = None,
    nominal: float = 0.0,
) -> Result:
    posed = scene(samples=21, accuracy="draft", symmetry="C4")
    search = SearchOptions(samples=4, ascents=1, evaluations=4)
    return minimise_worst(
        posed,
        SHAKEN,
        Limits(edge_length=3.0, block_angle=0.5, void_angle=0.0, gap=0.2),
        sqp=SqpOptions(evaluations=8, radius=0.5),
        options=FamilyOptions(nominal=nominal, evaluations=4, search=search),
        journal=journal,
        callback=callback,
    )


def kill(evaluation: Evaluation) -> None:
    if evaluation.number == 5:
        raise KeyboardInterrupt


@pytest.mark.slow
def test_the_worst_loss_is_minimised_and_resumed(tmp_path: Path) -> None:
    """The drive's own loads, at 5 Hz, do not tell of the worst one."""
    with Journal(tmp_path / "j", "key") as journal, pytest.raises(KeyboardInterrupt):
        minimised(journal, kill)
    with Journal(tmp_path / "j", "key") as journal:
        result = minimised(journal)
        assert journal.replayed > 6  # the searches' too
    np.testing.assert_array_equal(result.x, minimised().x)
    assert [each.number for each in result.evaluations] == list(range(8))
    first, best = result.evaluations[0], result.evaluations[result.best]
    np.testing.assert_array_equal(best.x, result.x)
    assert len(first.aux) > 4  # the drive's own four, and those found
    assert first.aux[4:].max() > first.aux[:4].max()
    assert best.aux.max() < 0.7 * first.aux.max()


@pytest.mark.slow
def test_a_share_of_the_own_loads_counts_in_which_design_is_best(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of two descents the second has the lower worst loss, and the higher own one."""
    own, worst, place = iter((0.2, 0.5)), iter((1.0, 1.0, 0.9)), np.full(3, 0.5)

    def descend(*words: object, **options: object) -> Result:
        result = minimise(*words, **options)  # type: ignore[arg-type]
        return replace(result, aux=np.full_like(result.aux, next(own)))

    monkeypatch.setattr(exchange, "minimise_loss", descend)
    monkeypatch.setattr(exchange, "search_worst", lambda *_: [FoundLoad(place, next(worst), place)])
    assert minimised(nominal=0.9).best < 4


def test_forces_are_not_mimicked_over_loads_in_ranges() -> None:
    made = mimicked().updated(reaction=0.5)
    with pytest.raises(ValueError, match="motions alone"):
        LoadLosses(made, PUSHED, parameters_of_design(made)).value(design_of(made), np.zeros(2))
