"""Stage: a design under finer load steps and the other contact law, beside those of the run."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pipeline import cli, problem
from pipeline.errors import UserError
from pipeline.measuring import UNSTABLE, Measured

if TYPE_CHECKING:
    import xarray as xr

    from pipeline.problem import Problem

LOG = logging.getLogger(__name__)

Table = dict[str, list[Measured]]

AS_RUN = "as run"
FINER = (2, 10)
"""How many times more load steps the loss is checked with."""


def parser() -> argparse.ArgumentParser:
    """The stage's command line."""
    made = cli.parser(
        "pipeline.verify", "Check a design with finer load steps and another contact."
    )
    made.add_argument("--design", type=Path, required=True, metavar="NC", help="the design")
    made.add_argument("--out", type=Path, required=True, metavar="NC", help="dataset to write")
    made.add_argument("--threads", type=int, default=1, help="cases simulated side by side")
    return made


def work(args: argparse.Namespace) -> None:
    """Simulates the structures of a design under every variant of the problem."""
    from pipeline import datasets, provenance

    asked = problem.load(args.problem, args.preset)
    if asked.horizon.steps is None:
        raise UserError(
            "the loss of this problem is not taken on load steps",
            file=args.problem,
            key="horizon.steps",
            remedy="give horizon.steps, or leave the check out",
        )
    design = datasets.read(args.design, "design")
    made = checks(asked, args.problem.parent, design, args.threads)
    origin = provenance.attributes(asked, "verify", parents={"design": args.design})
    datasets.write(made, args.out, "verification", origin)


def variants(asked: Problem) -> dict[str, Problem]:
    """The problem as run first, then otherwise alike ones; all show the loads of the run."""
    steps = asked.horizon.steps
    assert steps is not None
    shown = asked.response.model_copy(update={"samples": steps + 1})
    as_run = asked.model_copy(update={"response": shown})
    finer = {f"{times} x load steps": steps * times for times in FINER}
    return {
        AS_RUN: as_run,
        **{
            name: as_run.model_copy(
                update={"horizon": asked.horizon.model_copy(update={"steps": count})}
            )
            for name, count in finer.items()
        },
    }


def checks(asked: Problem, folder: Path, design: xr.Dataset, threads: int = 1) -> xr.Dataset:
    """The dataset ``verification``; a variant that cannot be simulated keeps its reason."""
    from pipeline.responses import loss_units
    from pipeline.scenes import scene_of
    from pipeline.simulate import measured_cases, structures_of, times_of

    posed = variants(asked)
    found: dict[str, Table] = {}
    status = dict.fromkeys(posed, "ok")
    for name, variant in posed.items():
        structures = structures_of(scene_of(variant, folder), design)
        times = times_of(variant, structures["altered"].scene)
        try:
            found[name], _ = measured_cases(structures, times, threads)
        except UserError as error:
            if name == AS_RUN:
                raise
            LOG.warning("%s: %s", name, error.what)
            status[name] = error.what
    shares = {name: _share(asked, variant) for name, variant in posed.items()}
    made = _dataset(found, shares, status)
    made["loss"].attrs["units"] = loss_units(asked)
    return made


def _dataset(
    found: dict[str, Table], shares: dict[str, float], status: dict[str, str]
) -> xr.Dataset:
    import xarray as xr

    as_run = found[AS_RUN]
    rows = [
        [
            _numbers(found[name][structure], cases, shares[name]) if name in found else NOTHING
            for structure, cases in as_run.items()
        ]
        for name in status
    ]
    columns = {
        field: np.array([[getattr(numbers, field) for numbers in row] for row in rows])
        for field in Numbers._fields
    }
    return xr.Dataset(
        {name: (("check", "structure"), values) for name, values in columns.items()}
        | {"status": (("check",), list(status.values()))},
        {"check": list(status), "structure": list(as_run)},
    )


class Numbers(NamedTuple):
    """What is kept of a structure under one variant: the extremes of its load cases."""

    loss: float
    departure: float
    min_void_angle: float
    gap: float
    overlaps: int
    contact_pairs: int
    unstable: int


NOTHING = Numbers(np.nan, np.nan, np.nan, np.nan, 0, 0, 0)


def _share(asked: Problem, variant: Problem) -> float:
    """What makes the loss of a variant comparable: that of mimicking is a sum over the steps."""
    mimics = asked.objective.target == "intact" and asked.objective.kind == "displacement"
    assert asked.horizon.steps is not None
    assert variant.horizon.steps is not None
    return float(np.sqrt(asked.horizon.steps / variant.horizon.steps)) if mimics else 1.0


def _numbers(cases: list[Measured], as_run: list[Measured], share: float) -> Numbers:
    apart = [
        np.linalg.norm((one.displacement - other.displacement)[..., :2], axis=-1).max()
        for one, other in zip(cases, as_run, strict=True)
    ]
    return Numbers(
        loss=share * float(np.mean([case.loss for case in cases])),
        departure=float(max(apart)),
        min_void_angle=min(float(case.observables.void_angle.min()) for case in cases),
        gap=min(float(np.nanmin(case.gap)) for case in cases),
        overlaps=max(int(np.nanmax(case.overlapping)) for case in cases),
        contact_pairs=max(int(case.observables.contact_pairs[-1]) for case in cases),
        unstable=sum(int((case.stability == UNSTABLE).sum()) for case in cases),
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
