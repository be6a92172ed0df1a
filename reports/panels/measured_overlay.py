"""Tells how every figure and every player shows measurement beside simulation.

Measured curves are dashed with markers, simulated ones continuous, prediction bands behind both.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.datasets import SYNTHETIC_LABEL
from reports.base import prose, style
from reports.panels.animation_data import AnimationClip
from reports.study import RecordedMotion, from_dataset
from sim.core import Floats

MARKERS = 22
"""Of a measured curve."""
_DASHES = (0, (2.6, 1.4))
_PROSE = prose(__file__)


def measured_curve(axes: Axes, along: Floats, values: Floats, colour: str) -> None:
    """Draws a measured curve, its markers evenly spread."""
    every = max(1, len(along) // MARKERS)
    axes.plot(
        along, values, color=colour, lw=0.8, ls=_DASHES, marker="o", ms=2.0, mfc="white",
        mew=0.6, markevery=(every // 2, every), zorder=5,
    )  # fmt: skip


def band(axes: Axes, along: Floats, low: Floats, high: Floats, colour: str) -> None:
    """Draws a prediction band."""
    axes.fill_between(along, low, high, color=colour, alpha=0.22, lw=0, zorder=2)


def handles(recordings: Sequence[RecordedMotion]) -> list[Artist]:
    """Tells what a legend tells of continuous and dashed lines, and of bands."""
    if not recordings:
        return []
    mark = f" ({SYNTHETIC_LABEL})" if any(each.synthetic for each in recordings) else ""
    dashed = Line2D(
        [], [], color=style.GREY, lw=0.8, ls=_DASHES, marker="o", ms=2.0, mfc="white", mew=0.6,
        label=f"experiment{mark}",
    )  # fmt: skip
    lines: list[Artist] = [Line2D([], [], color=style.GREY, lw=1.2, label="simulation"), dashed]
    shade = Patch(color=style.GREY, alpha=0.3, lw=0, label="prediction band")
    return [*lines, shade]


def clips(
    recordings: Sequence[RecordedMotion], simulated: AnimationClip, wanted: Floats, spacing: float
) -> list[AnimationClip]:
    """Forms clips of the recordings of one structure, each under its own case, with residual.

    A second one of the same load case is a clip of its own; `wanted` (n_frames,) is where along the
    course.
    """
    trials: list[dict[int, RecordedMotion]] = []
    for each in recordings:
        free = next((trial for trial in trials if each.case not in trial), None)
        if free is None:
            trials.append(free := {})
        free[each.case] = each
    return [_clip(trial, simulated, wanted, spacing) for trial in trials]


def _clip(
    trial: Mapping[int, RecordedMotion], simulated: AnimationClip, wanted: Floats, spacing: float
) -> AnimationClip:
    first = next(iter(trial.values()))
    shape = (len(simulated.motion), len(wanted), *simulated.motion.shape[2:])
    motion, residual = np.full(shape, np.nan), np.full(shape, np.nan)
    for case, each in trial.items():
        motion[case] = each.at(each.data["measured"], wanted)
        residual[case] = each.at(each.data["residual"], wanted)
    return AnimationClip(
        f"{simulated.name}, {first.source}",
        simulated.colour,
        from_dataset(first.data, spacing),
        motion,
        simulated.marker,
        residual,
    )


def caption(recordings: Sequence[RecordedMotion], place: str = "", *, banded: bool = True) -> str:
    """Tells what a figure with recordings says of them, as HTML; nothing without.

    Snapshots of an experiment have their `place` by those of its simulation, if there are any;
    bands are told of where they are drawn.
    """
    if not recordings:
        return ""
    told = [*["snapshots"] * bool(place), "experiment"]
    told += ["synthetic"] * any(each.synthetic for each in recordings)
    bands = _PROSE["bands"].format(level=100 * recordings[0].level) if banded else ""
    words = {"label": SYNTHETIC_LABEL, "bands": bands, "place": place}
    return "".join(f" {_PROSE[name].format_map(words)}" for name in told)
