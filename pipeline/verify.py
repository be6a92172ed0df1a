"""Stage: a design under finer load steps and the other contact law, beside those of the run."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline import cli, problem
from pipeline.errors import UserError

if TYPE_CHECKING:
    import xarray as xr

    from pipeline.problem import Problem

LOG = logging.getLogger(__name__)

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
    import xarray as xr

    from pipeline.scenes import scene_of
    from pipeline.simulate import response_dataset, structures_of

    rows: list[xr.Dataset] = []
    as_run: xr.Dataset | None = None
    posed = variants(asked)
    for variant in posed.values():
        structures = structures_of(scene_of(variant, folder), design)
        try:
            made, _ = response_dataset(variant, structures, threads)
        except UserError as error:
            if as_run is None:
                raise
            LOG.warning("%s", error.what)
            rows.append(_nothing(rows[0], error.what))
        else:
            as_run = made if as_run is None else as_run
            rows.append(_row(made, as_run, _share(asked, variant)))
    whole = xr.concat(rows, dim=xr.DataArray(list(posed), dims="check", name="check"))
    assert as_run is not None
    whole["loss"].attrs["units"] = as_run["loss"].attrs["units"]
    return whole


def _share(asked: Problem, variant: Problem) -> float:
    """What makes the loss of a variant comparable: that of mimicking is a sum over the steps."""
    mimics = asked.objective.target == "intact" and asked.objective.kind == "displacement"
    assert asked.horizon.steps is not None
    assert variant.horizon.steps is not None
    return float(np.sqrt(asked.horizon.steps / variant.horizon.steps)) if mimics else 1.0


def _row(made: xr.Dataset, as_run: xr.Dataset, share: float) -> xr.Dataset:
    """What is kept of one variant, by structure: the extremes of its load cases."""
    import xarray as xr

    apart = (made["displacement"] - as_run["displacement"]).isel(dof=slice(0, 2))
    distance = ((apart**2).sum("dof") ** 0.5).max(("case", "time", "unit"))
    unstable = (made["stability"] == 0).sum(("case", "time"))
    kept = {
        "loss": share * made["loss"].mean("case"),
        "departure": distance,
        "min_void_angle": made["min_void_angle"].min(("case", "time")),
        "gap": made["min_gap"].min("case"),
        "overlaps": made["overlaps"].max("case"),
        "contact_pairs": made["contact_pairs"].isel(time=-1).max("case"),
        "unstable": unstable,
        "status": xr.DataArray("ok"),
    }
    return xr.Dataset(
        {name: values.drop_vars("time", errors="ignore") for name, values in kept.items()}
    )


def _nothing(row: xr.Dataset, reason: str) -> xr.Dataset:
    """A row like another one without its values."""
    import xarray as xr

    empty = {
        name: xr.zeros_like(values) if values.dtype.kind == "i" else xr.full_like(values, np.nan)
        for name, values in row.drop_vars("status").items()
    }
    return xr.Dataset({**empty, "status": xr.DataArray(reason)})


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
