"""Stage: the losses of designs over a family of loads, random ones and the worst.

They are losses of structures as designed, also where a design is optimised over imperfect copies.
"""

import argparse
import hashlib
import logging
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import load_family, loss_units, read_design, scene_of, structures_of
from pipeline.problem import Problem
from pipeline.runtime import UserError, cli, source_hash
from sim.core import Floats, Ints, SimulationError
from sim.load_family import LoadFamily, LoadLosses, ascend
from sim.optimise import Journal
from sim.scene import DIRECTED, Scene, concrete_parameters
from sim.solvers import Superposition

LOG = logging.getLogger(__name__)

LOADS, SEARCHES = 1000, 50
"""Random loads, and searches of the worst one from random starts."""
SEED = 2025
BATCH = 20
"""Loads between two entries of the journal."""
EVALUATIONS = 12
"""Of the loss and its gradient in a search, about."""
_NO_DESIGN: Floats = np.zeros(0)


def work(args: argparse.Namespace) -> None:
    """Reads the designs, computes the losses, writes the certificate.

    Raises:
        UserError: the problem asks for no family of loads, or a design is of another lattice.
    """
    asked = problem.load(args.problem, args.preset)
    family = loads_in_ranges(asked, args.problem)
    paths = {"cloaked": args.design} | ({} if args.other is None else {"study": args.other})
    words = (problem.section_hash(asked, "certify"), source_hash("pipeline.stages.certify"))
    hashes = map(provenance.file_hash, paths.values())
    with losses_journal(args.out, "certify", (*words, *hashes)) as journal:
        made = certificate(asked, family, args.problem.parent, paths, journal, args.threads)
    origin = provenance.of_study(asked, "certify", parents=paths)
    datasets.write(made, args.out, "certificate", origin)


def loads_in_ranges(asked: Problem, source: Path) -> LoadFamily:
    """Builds the family of loads of a problem, whose file is `source`.

    Raises:
        UserError: it asks for none.
    """
    family = load_family(asked, source.parent)
    if family is None:
        remedy = "add objective.loads, or name a preset that has it"
        what = "the problem asks for no loads in ranges"
        raise UserError(what, file=source, key="objective.loads", remedy=remedy)
    robust = asked.objective.robust
    if robust is not None and robust.copies:
        LOG.warning(
            "%s: losses here are of the structure as designed, not of the %d imperfect copies of"
            " objective.robust.copies",
            source,
            robust.copies,
        )
    return family


def losses_journal(out: Path, stage: str, words: Iterable[str]) -> Journal:
    """Returns the journal of losses for a dataset, named by all that they depend on."""
    key = " ".join(words)
    folder = out.parent / ".journal" / f"{stage}_{hashlib.sha256(key.encode()).hexdigest()[:16]}"
    folder.mkdir(parents=True, exist_ok=True)
    return Journal(folder / "losses.journal", key)


def nominal_places(scene: Scene, family: LoadFamily) -> Floats:
    """Finds the places (n_cases, n) of the drive's own loads in a family."""
    motions = [each for each in scene.loads.motions if isinstance(each, DIRECTED | Superposition)]
    return np.array([family.place(motion) for motion in motions])


def certificate(
    asked: Problem,
    family: LoadFamily,
    folder: Path,
    paths: Mapping[str, Path],
    journal: Journal,
    threads: int,
) -> xr.Dataset:
    """Makes the dataset ``certificate`` of designs by name."""
    scene = scene_of(asked, folder)
    random = np.random.default_rng(SEED)
    loads = random.random((LOADS, family.size))
    starts = random.random((SEARCHES, family.size))
    own = nominal_places(scene, family)
    rows = []
    with cli.progress(len(paths) * (LOADS + len(own) + SEARCHES), "loads") as bar:
        for path in paths.values():
            structure = structures_of(scene, read_design(asked, path))["cloaked"]
            evaluator = BatchedLosses(*structure, family, journal, threads, bar.update)
            rows.append(
                (evaluator.losses(loads), evaluator.losses(own), evaluator.searches(starts))
            )
    losses, nominal, found = (np.array(part) for part in zip(*rows, strict=True))
    ends = found[..., -1]
    made = xr.Dataset(
        {
            **_load_variables("load", ("load",), family, loads),
            "loss": (("design", "load"), losses),
            **_load_variables("found", ("design", "search"), family, found[..., :-1]),
            # a search may have come to no load that can be simulated
            "found_loss": (("design", "search"), np.where(np.isfinite(ends), ends, np.nan)),
            "nominal_loss": (("design",), nominal @ scene.loads.case_weights),
            "nominal_worst": (("design",), nominal.max(axis=1)),
        },
        {"design": list(paths)},
    )
    for name in ("loss", "found_loss", "nominal_loss", "nominal_worst"):
        made[name].attrs["units"] = loss_units(asked)
    return made


def _load_variables(
    name: str, dims: tuple[str, ...], family: LoadFamily, places: Floats
) -> dict[str, tuple[tuple[str, ...], Floats | Ints]]:
    """Lists directions in degrees, amplitudes, frequencies and set-ups of places (..., n)."""
    numbers = family.numbers(places)
    unknown = np.full(numbers.shape[:-1], np.nan)
    return {
        f"{name}_direction": (dims, np.rad2deg(numbers[..., 0])),
        f"{name}_amplitude": (dims, numbers[..., 1]),
        f"{name}_frequency": (dims, unknown if numbers.shape[-1] == 2 else numbers[..., 2]),
        f"{name}_setup": (dims, family.number(places)),
    }


class BatchedLosses:
    """Computes losses of one design under loads, in batches that a journal remembers."""

    def __init__(
        self,
        scene: Scene,
        vertices: Floats,
        family: LoadFamily,
        journal: Journal,
        threads: int,
        done: Callable[[int], None],
    ) -> None:
        values = concrete_parameters(scene, vertices)
        self._losses = LoadLosses(scene, family, lambda _: values)
        self._family, self._journal, self._threads, self._done = family, journal, threads, done

    def losses(self, places: Floats) -> Floats:
        """Losses (n,) at places (n, n_numbers); NaN where the load cannot be simulated."""

        def one(place: Floats) -> Floats:
            try:
                return np.array([self._losses.value(_NO_DESIGN, place)])
            except SimulationError:
                return np.array([np.nan])

        return self._in_batches(one, places)[:, 0]

    def searches(self, starts: Floats) -> Floats:
        """Places where searches end, with the loss there (n, n_numbers + 1)."""

        def one(start: Floats) -> Floats:
            found = ascend(self._loss, start, EVALUATIONS)
            return np.append(found.place, found.loss)

        return self._in_batches(one, starts)

    def _loss(self, place: Floats) -> tuple[float, Floats]:
        found = self._losses(_NO_DESIGN, place)
        return found.value, found.by_place

    def _in_batches(self, one: Callable[[Floats], Floats], places: Floats) -> Floats:
        """Maps over rows (n, k) of places, on threads."""

        def batch(joined: Floats) -> tuple[float, Floats, Floats]:
            with ThreadPoolExecutor(self._threads) as pool:
                rows = list(pool.map(one, joined.reshape(-1, places.shape[1])))
            return 0.0, _NO_DESIGN, np.array(rows)

        remembered, found = self._journal.wrap(batch), []
        for first in range(0, len(places), BATCH):
            part = places[first : first + BATCH]
            found.append(remembered(part.ravel())[2])
            self._done(len(part))
        return np.concatenate(found)
