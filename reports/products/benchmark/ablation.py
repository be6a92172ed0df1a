"""What skipping saves: each thing done and skipped, one above the other."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from reports.base import style

DONE, SKIPPED = "done", "skipped"
_ROW, _LEFT, _WIDE = 8.0, 44.0, 84.0
_COLOURS = {DONE: style.GREY, SKIPPED: style.CLOAKED}


def draw_ablation(data: xr.Dataset) -> Figure:
    """Bars of time, and beside them how many times less it takes and what the result changes by."""
    names = list(dict.fromkeys(data["method"].values))
    high = len(names) * _ROW
    figure = style.page(high + 24.0)
    axes = style.place(figure, _LEFT, 10.0, _WIDE, high)
    for row, name in enumerate(names):
        chosen = data.isel(point=np.flatnonzero(data["method"].values == name))
        times = {
            str(setting): float(np.nanmedian(runs)) if np.isfinite(runs).any() else np.nan
            for setting, runs in zip(
                chosen["setting"].values, chosen["cpu_time"].values, strict=True
            )
        }
        for offset, setting in ((-0.18, DONE), (0.18, SKIPPED)):
            axes.barh(row + offset, times[setting], height=0.34, color=_COLOURS[setting])
        change = np.nanmax(chosen["error"].values, initial=0.0)
        told = f"{times[DONE] / times[SKIPPED]:.2f} ×,  change {change:.1e}"
        axes.text(1.03, row, told, transform=axes.get_yaxis_transform(), va="center")
    axes.set_yticks(range(len(names)), names)
    axes.set(xscale="log", xlabel="processor time of one run, s", ylim=(len(names) - 0.5, -0.5))
    for setting, colour in _COLOURS.items():
        axes.bar(0, 0, color=colour, label=setting)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure
