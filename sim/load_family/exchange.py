"""Minimises the worst loss over a family of loads, by a set of loads that grows.

The design is optimised for a set of loads; then the worst load for it is searched among all of the
family, and joins the set; loads that do no harm leave it. Both alternate until all evaluations are
used; while no load is found that is much worse than those in the set, descents are longer (a
semi-infinite programme, solved by exchange: Hettich and Kortanek 1993, SIAM Rev. 35, 380).
"""

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sim.constraints import Limits
from sim.core import Floats
from sim.load_family.family import LoadFamily
from sim.load_family.family_losses import LoadLosses
from sim.load_family.worst_load import LEAST_DISTANCE, FoundLoad, SearchOptions, search_worst
from sim.optimise import Evaluate, Evaluation, Journal, Result, SqpOptions
from sim.optimise import minimise as minimise_loss
from sim.scene import DIRECTED, Scene, combined, constraints_of, make_plan, parameters_of_copies
from sim.solvers import MotionLaw, Superposition

LOG = logging.getLogger(__name__)

FOUND = 1.05
"""Loss of a load found, over the worst in the set, up to which the set stands for the family."""
HARMLESS, IDLE = 0.6, 3
"""Loss, over the worst, below which a load does no harm; searches in a row of which it leaves."""
RESTARTS = 3
"""Evaluations between two searches, over those asked for, where descents start again."""


@dataclass(frozen=True)
class FamilyOptions:
    """Holds how the worst loss over a family is minimised."""

    sharpness: float = 16.0  # p of the p-mean of the losses under the loads in the set
    nominal: float = 0.0  # share of the mean loss under the drive's own loads in what is minimised
    evaluations: int = 16  # of the set's losses between two searches, at most
    search: SearchOptions = field(default_factory=SearchOptions)  # of the worst load


class LoadSearch:
    """Searches the worst loads for designs; a journal remembers all losses that it computes.

    Each search looks at other places, so that loads which one has missed are found by the next.
    """

    def __init__(
        self, losses: LoadLosses, wrap: Callable[[Evaluate], Evaluate], options: SearchOptions
    ) -> None:
        size, self._family, self._searches = losses.family.size, losses.family, 0
        self._options = options

        def value(joined: Floats) -> tuple[float, Floats, Floats]:
            return losses.value(joined[:-size], joined[-size:]), np.zeros(0), np.zeros(0)

        def loss(joined: Floats) -> tuple[float, Floats, Floats]:
            found = losses(joined[:-size], joined[-size:])
            return found.value, found.by_place, np.zeros(0)

        self._value, self._loss = wrap(value), wrap(loss)

    def __call__(self, design: Floats, known: Iterable[Floats] = ()) -> list[FoundLoad]:
        """Searches for a design (n_variables,), from known places besides."""

        def value(place: Floats) -> float:
            return self._value(np.concatenate([design, place]))[0]

        def loss(place: Floats) -> tuple[float, Floats]:
            return self._loss(np.concatenate([design, place]))[:2]

        options = replace(self._options, seed=self._options.seed + self._searches)
        self._searches += 1
        return search_worst(value, loss, self._family, options, known)


class LoadSet:
    """Computes what is minimised: the p-mean of the losses under a set of loads.

    Args:
        losses: of the family.
        scene: whose load cases, the drive's own, stay in the set.
        options: of the minimisation.
    """

    def __init__(self, losses: LoadLosses, scene: Scene, options: FamilyOptions) -> None:
        case_of = make_plan(scene).case_of
        simulated, self._own_of = np.unique(case_of, return_inverse=True)
        motions = [scene.loads.motions[case] for case in simulated]
        self.own = np.array([losses.family.place(_directed(motion)) for motion in motions])
        self.added = np.zeros((0, losses.family.size))
        self._idle = np.zeros(0, dtype=np.int64)
        self._losses, n_own = losses, len(self.own)
        weights = jnp.asarray(np.bincount(self._own_of, scene.loads.case_weights))

        def value(each: jax.Array) -> jax.Array:
            alike = jnp.full(len(each), 1 / len(each))
            worst = combined(each, alike, options.sharpness)
            return (1 - options.nominal) * worst + options.nominal * (weights @ each[:n_own])

        self._value = jax.jit(jax.value_and_grad(value))

    @property
    def places(self) -> Floats:
        """(n_loads, n) of all loads in the set."""
        return np.concatenate([self.own, self.added])

    def __call__(self, design: Floats) -> tuple[float, Floats, Floats]:
        """Computes value, gradient (n_variables,) and losses (n_cases + n_added,) of a design."""
        found = [self._losses(design, place) for place in self.places]
        each = np.array([one.value for one in found])
        value, share = self._value(jnp.asarray(each))
        gradient = np.asarray(share) @ np.array([one.by_design for one in found])
        return float(value), gradient, np.append(each[self._own_of], each[len(self.own) :])

    def exchange(self, losses: Floats, found: Sequence[FoundLoad]) -> None:
        """Adds loads found, and removes those that did no harm for long by losses (n_added,)."""
        least = HARMLESS * max([found[0].loss, *losses])
        self._idle = np.where(losses < least, self._idle + 1, 0)
        kept = self._idle < IDLE
        self.added, self._idle = self.added[kept], self._idle[kept]
        for one in found:
            near = any(np.abs(one.place - other).max() < LEAST_DISTANCE for other in self.places)
            if one.loss >= least and not near:
                self.added = np.concatenate([self.added, one.place[None]])
                self._idle = np.append(self._idle, 0)


def _directed(motion: MotionLaw) -> DIRECTED | Superposition:
    assert isinstance(motion, DIRECTED | Superposition)
    return motion


def minimise_worst(
    scene: Scene,
    family: LoadFamily,
    limits: Limits,
    start: Floats | None = None,
    *,
    sqp: SqpOptions,
    options: FamilyOptions,
    journal: Journal | None = None,
    callback: Callable[[Evaluation], None] | None = None,
) -> Result:
    """Minimises the worst loss over a family of loads; returns the best design that a search ended.

    The best has the lowest worst loss, to which the drive's own loads add their share.

    The losses of an evaluation, ``aux``, are those of the drive's own loads, then of the others in
    the set; its loss is what is minimised over the set of the time.

    Args:
        scene: the scene, whose load cases are the drive's own loads.
        family: the loads.
        limits: what a design must keep to; on paths and of foil, under the drive's own loads.
        start: (n_variables,) design vector, mm; by default the initial structure.
        sqp: of the descents; its evaluations are those of all of them, without the searches.
        options: of the minimisation.
        journal: of evaluations, searches and constraints under loads, from which an interrupted run
            resumes exactly. Its key is to name all that they depend on.
        callback: called with each evaluation of the set as it is recorded.

    Raises:
        InfeasibleStartError: no feasible design near the start.
        SimulationError: the start cannot be simulated.
    """
    losses = LoadLosses(scene, without_copies(family, scene), *parameters_of_copies(scene))
    held = LoadSet(losses, scene, options)
    wrap: Callable[[Evaluate], Evaluate] = (lambda f: f) if journal is None else journal.wrap
    search, evaluate = LoadSearch(losses, wrap, options.search), wrap(held)
    constraints = constraints_of(scene, make_plan(scene), limits, journal)
    x = np.zeros(scene.space.n_variables) if start is None else start
    history: list[Evaluation] = []
    best: _Best | None = None

    def record(evaluation: Evaluation) -> None:
        history.append(replace(evaluation, number=len(history)))
        if callback is not None:
            callback(history[-1])

    held.exchange(np.zeros(0), search(x))
    settled = False
    while (left := sqp.evaluations - len(history)) > 0:
        first = len(history)
        descent = _descent_options(sqp, options, left, settled)
        result = minimise_loss("sqp", evaluate, constraints, x, options=descent, callback=record)
        x, known = result.x, float(result.aux.max())
        found = search(x, held.places)
        own, added = np.split(result.aux, [len(scene.loads.cases)])
        LOG.info("worst of %d loads %.5g, found %.5g", len(held.places), known, found[0].loss)
        worst, mean = max(known, found[0].loss), float(scene.loads.case_weights @ own)
        merit = (1 - options.nominal) * worst + options.nominal * mean
        settled = found[0].loss <= FOUND * known
        if best is None or merit < best.merit:
            best = _Best(merit, settled, replace(result, best=first + result.best))
        held.exchange(added, found)
    assert best is not None
    if not best.settled:
        LOG.warning("the worst load found is more than %g times those designed for", FOUND)
    return replace(best.result, evaluations=tuple(history))


class _Best(NamedTuple):
    """Holds the design of the lowest worst loss so far."""

    merit: float  # that loss, with the share of the drive's own loads
    settled: bool  # whether no load was found that is much worse than those in the set
    result: Result


def _descent_options(
    sqp: SqpOptions, options: FamilyOptions, left: int, settled: bool
) -> SqpOptions:
    """Bounds a descent for the set by the evaluations left; a longer one for a set that stands.

    New starts from inside the feasible set are for a set that stands for the family.
    """
    if settled:
        return replace(sqp, evaluations=min(left, RESTARTS * options.evaluations))
    return replace(sqp, evaluations=min(left, options.evaluations), retreats=0)


def without_copies(family: LoadFamily, scene: Scene) -> LoadFamily:
    """Leaves out directions whose loads are turned copies of others, by a design's symmetry."""
    first = family.setups[0]
    low, high = first.direction
    quarter = low + np.pi / 2
    if len(family.setups) > 1 or high <= quarter or isinstance(first.motion, Superposition):
        return family
    turned = scene.driven_by(*(first.motion._replace(direction=a) for a in (low, quarter)))
    if len(make_plan(turned).simulated) == 2:
        return family
    return LoadFamily((replace(first, direction=(low, quarter)),))
