"""Shows a problem before it is computed: a picture of it, its size, and what may not be meant."""

import argparse
import logging
import sys
from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline import problem
from pipeline.posing import (
    cost_line,
    doubts,
    lattice_of,
    network_variables,
    scene_of,
    spread,
    unit_coordinates,
    variant_faults,
)
from pipeline.problem import Problem
from pipeline.problem.sections import HarmonicDrive, RampHarmonicDrive
from pipeline.runtime import write_atomically
from reports.base import style
from reports.figures import kinds
from reports.figures.loading_path import DRIVE_TINT, INTEREST_TINT, UNIT_TINT, rest_panel
from reports.panels import CLAMP_TINT, CLOAK_TINT
from sim.scene import DOFS, Scene
from sim.solvers import TimeSeries

LOG = logging.getLogger(__name__)

SIDE = 110.0
"""Of the picture, mm."""


def report(args: argparse.Namespace) -> None:
    """Draws ``check.png`` and says the rest, then tells the faults of variants one by one.

    Raises:
        UserError: the last of the faults of the problem and of its variants.
    """
    own = args.preset or ""
    faults = variant_faults(args.problem, [own, *args.variants]) if args.variants else {}
    if own not in faults:
        _show(args)
    if faults:
        *others, last = faults.values()
        for fault in others:
            LOG.error("error: %s", fault)
        raise last


def _show(args: argparse.Namespace) -> None:
    """Draws a problem; what its scene itself warns of is logged."""
    asked = problem.load(args.problem, args.preset)
    scene = scene_of(asked, args.problem.parent)
    problem.check_measured_constants(asked, args.problem.parent)
    found = [*doubts(asked, scene), *_unread(asked)]
    told = [cost_line(asked, scene), *(f"warning: {line}" for line in found)]
    with style.styled():
        figure = style.page(SIDE + 22.0, SIDE)
        axes = style.place(figure, 2.0, 8.0, SIDE - 4.0, SIDE - 4.0)
        rest_panel(axes, asked, _at_rest(asked, scene), "cloaked")
        _removed(axes, asked, scene)
        axes.set_title(style.literal(asked.title or args.problem.parent.name))
        _legend(axes, asked, clamped=len(scene.loads.clamped) > 0)
        path = args.out_dir / "check.png"
        with write_atomically(path) as aside:
            figure.savefig(aside, format="png", dpi=150)
    print("\n".join([*told, f"picture: {path}"]), file=sys.stderr)  # noqa: T201


def _unread(asked: Problem) -> Iterator[str]:
    """Doubts keys that no figure reads, or for which there is none."""
    if asked.designs is not None and not isinstance(asked.drive, HarmonicDrive | RampHarmonicDrive):
        yield (
            "the page of several `designs` is of harmonic drives, not of"
            f" `{asked.drive.kind}`: build each by its number for a page of its own, such as"
            " NAME@1"
        )
    if asked.report.places and kinds.kind_of(asked) is not kinds.WAVE:
        yield (
            "`report.places` are shown where a motion in time is to be that of the intact lattice"
            " only; remove them"
        )


def _at_rest(asked: Problem, scene: Scene) -> xr.Dataset:
    intact, lattice = lattice_of(asked), scene.lattice
    places = spread(lattice.padded(lattice.vertices), lattice, intact.n_units)
    variables = {
        **network_variables(asked, scene),
        "vertices": (("structure", "unit", "vertex", "xy"), places[None]),
    }
    motion = scene.loads.motions[0]
    if isinstance(motion, TimeSeries):
        read = np.asarray(motion.times)  # which may go on after the end
        times = np.append(read[read < asked.horizon_time], asked.horizon_time)
        course = np.asarray(motion(times))[None, None, :, None]
        whole = np.broadcast_to(course, (1, 1, len(times), intact.n_units, 3))
        variables["displacement"] = (("structure", "case", "time", "unit", "dof"), whole)
    coordinates = {
        **unit_coordinates(intact),
        "structure": (("structure",), ["cloaked"]),
        "dof": ("dof", list(DOFS)),
    }
    return xr.Dataset(variables, coordinates)


def _removed(axes: Axes, asked: Problem, scene: Scene) -> None:
    intact = lattice_of(asked)
    gone = np.setdiff1d(intact.id, scene.lattice.id)
    rings = [ring[np.isfinite(ring[:, 0])] for ring in intact.padded(intact.vertices)[gone]]
    made = PolyCollection(rings, facecolors="none", edgecolors=style.GREY, linewidths=0.3)
    made.set(linestyle="dashed", zorder=1)
    axes.add_collection(made)


def _legend(axes: Axes, asked: Problem, *, clamped: bool) -> None:
    tints = {"redesigned": CLOAK_TINT}
    if clamped:
        tints |= {"clamped": CLAMP_TINT}
    tints |= {"driven": DRIVE_TINT}
    if asked.objective.region != "surroundings":
        tints |= {"of interest": INTEREST_TINT}
    told: list[Artist] = [
        Patch(color=colour, label=name) for name, colour in {**tints, "other": UNIT_TINT}.items()
    ]
    if asked.void is not None:
        told.append(Line2D([], [], color=style.ALTERED, label="void as drawn"))
    axes.legend(handles=told, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=3)
