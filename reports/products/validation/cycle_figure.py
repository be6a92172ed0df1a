"""Draws load cycles as they were measured, with snaps, and equilibria beside them."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from pipeline.datasets.tables import ROLES
from reports.base import style

_STYLES = {
    "closing": ("-", style.INTACT, "measured, nearing"),
    "opening": ("-", style.GREY, "measured, parting"),
    "equilibrium_closing": ("-", style.CLOAKED, "equilibria, nearing"),
    "equilibrium_opening": ("--", style.ALTERED, "equilibria, parting"),
}


def draw_cycles(made: xr.Dataset) -> Figure:
    """Draws one panel a record, two in a row."""
    count = made.sizes["record"]
    rows = -(-count // 2)
    drawn = style.page(58.0 * rows)
    for k in range(count):
        row, column = divmod(k, 2)
        left, top = 12.0 + 89.0 * column, 58.0 * row
        style.letter(drawn, left - 10.0, top + 1.0, "abcdefgh"[k], str(made["title"].values[k]))
        axes = style.place(drawn, left, top + 8.0, 72.0, 40.0)
        mine = made["record_of_point"].values == k
        seen = made["force"].values[mine & (made["role"].values < 2)]
        for role, number in ROLES.items():
            chosen = mine & (made["role"].values == number)
            if chosen.any():
                line, colour, label = _STYLES[role]
                x, y = made["displacement"].values[chosen], made["force"].values[chosen]
                axes.plot(x, y, line, color=colour, linewidth=0.8, label=label)
                if number < 2:
                    wide = np.nan_to_num(made["scatter"].values[chosen])
                    axes.fill_between(x, y - wide, y + wide, color=style.PALE, linewidth=0)
        snaps = made["record_of_snap"].values == k
        for end, force in (("snap_start", "snap_peak"), ("snap_end", "snap_rest")):
            label = "ends of a snap" if end == "snap_start" and snaps.any() else None
            x, y = made[end].values[snaps], made[force].values[snaps]
            axes.plot(x, y, "o", mfc="none", color=style.ALTERED, markersize=4, label=label)
        reach = 1.25 * np.abs(seen).max()
        axes.set(xlabel="approach of the clamps, mm", ylabel="tension, N", ylim=(-reach, reach))
        axes.axhline(0, color=style.GREY, linewidth=0.4)
        axes.legend(loc="best")
    return drawn
