"""Draws a spectrum: lowest modes, transmission of the drive, bands of the unit cell."""

import argparse
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline import datasets, problem
from pipeline.problem import Problem
from pipeline.problem.sections import Kagome, Lattice
from reports.base import Table, prose, style
from reports.facts import headed
from reports.page import FigureText, figure_page, publish, titled
from reports.panels import draw
from reports.study import display_name, draft, from_dataset, study_results

_PROSE = prose(__file__)
_FILES = ("transmission.csv", "modes.csv", "bands.csv")
MODES = 4
"""Modes of each structure that are drawn, the lowest ones."""
SHOWN = 0.45
"""Largest motion of a drawn mode, in spacings."""
_DECADES = 10.0
"""Spread of the transmission from which on its axis is logarithmic."""
_SIDE, _PITCH, _LEFT, _TOP = 36.0, 41.5, 10.0, 9.0
_ROW = _SIDE + 4.5


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    asked = problem.load(args.problem, args.preset)
    data = datasets.read(args.spectrum, "spectrum")
    study_results.check_problem(asked, "spectrum", data, args.spectrum)
    text = FigureText(
        titled(asked, args.problem), "small vibrations", _PROSE["lead"], _PROSE["caption"]
    )
    tables = [
        Table(file, words, _columns(data[name]))
        for file, (name, words) in zip(_FILES, _PROSE["tables"].items(), strict=True)
    ]
    reduced = draft.reasons(asked, problem.load(args.problem))

    def drawn() -> Figure:
        figure = draw_spectrum(data, asked)
        if reduced:
            draft.mark(figure)
        return figure

    made = figure_page("spectrum", text, drawn, tables, data, draft=reduced)
    publish(made, args.out_dir)


def _columns(values: xr.DataArray) -> dict[str, list[object]]:
    frame = values.rename("value").to_dataframe().reset_index()
    units = {str(name): values[name].attrs.get("units", "1") for name in values.coords}
    units["value"] = values.attrs.get("units", "1")
    return {
        headed(str(column), units.get(str(column), "1")): frame[column].tolist()
        for column in (*values.dims, "value")
    }


def draw_spectrum(data: xr.Dataset, asked: Problem) -> Figure:
    """Draws the figure at two-column width."""
    names = list(data["structure"].values)
    below = _TOP + len(names) * _ROW + 3.0
    figure = style.page(below + 66.0)
    state = data["state"].values[:2][-1]
    style.letter(figure, 1.0, 1.0, "a", f"Lowest modes {state}")
    for row, name in enumerate(names):
        top = _TOP + row * _ROW
        style.write(
            figure, 2.0, top + _SIDE / 2, display_name(asked, name), rotation=90.0, va="center",
            color=style.STRUCTURE_COLOURS[name],
        )  # fmt: skip
        for mode in range(min(MODES, data.sizes["mode"])):
            axes = style.place(figure, _LEFT + mode * _PITCH, top, _SIDE, _SIDE)
            _mode(axes, data.sel(structure=name, state=state), mode, asked.lattice.spacing)
    style.letter(
        figure, 1.0, below, "b", "Motion of the region of interest per motion of the drive"
    )
    _transmission(style.place(figure, 13.0, below + 14.0, 70.0, 42.0), data, asked)
    style.letter(figure, 95.0, below, "c", "Waves in the intact lattice")
    axes = style.place(figure, 108.0, below + 14.0, 64.0, 42.0)
    bands_panel(axes, data, zone_points(asked.lattice))
    return figure


def _mode(axes: Axes, data: xr.Dataset, mode: int, spacing: float) -> None:
    structure = from_dataset(data, spacing)
    motion = data["mode_shape"].isel(mode=mode).transpose("unit", "dof").values
    size, reach = np.linalg.norm(motion[:, :2], axis=1), SHOWN * spacing
    base = np.nan_to_num(data["equilibrium"].transpose("unit", "dof").values)
    moved = base + reach * np.nan_to_num(motion)
    draw(axes, structure, moved, values=size, colour_map=style.MAGNITUDE, margin=reach)
    axes.set_title(f"{data['frequency'].values[mode]:.1f} Hz", pad=1.5, fontsize=style.SMALL)


def _transmission(axes: Axes, data: xr.Dataset, asked: Problem) -> None:
    excited = data["excitation"].values
    for name in data["structure"].values:
        shown = display_name(asked, name).lower()
        squares = data["transmission"].sel(structure=name) ** 2
        at_rest, loaded = squares.isel(state=[0]), squares.isel(state=slice(1, None))
        drawn = [("at rest", at_rest, "-"), ("loaded", loaded, (0, (3.0, 1.5)))]
        for state, curves, dashes in drawn if loaded.size else drawn[:1]:
            axes.plot(
                excited, np.sqrt(curves.mean(["state", "case"])),
                color=style.STRUCTURE_COLOURS[name], linestyle=dashes, linewidth=0.8,
                label=f"{shown}, {state}" if loaded.size else shown,
            )  # fmt: skip
    if asked.frequency is not None and excited[0] <= asked.frequency <= excited[-1]:
        axes.axvline(asked.frequency, color=style.GREY, linewidth=0.6, linestyle=":")
        across, at = ("data", "axes fraction"), (asked.frequency, 1.0)
        look = {"ha": "left", "va": "baseline", "color": style.GREY}
        style.note(axes, at, "drive", (2, -7), xycoords=across, **look)
    axes.set(
        xlabel="frequency (Hz)",
        ylabel="rms |u| / amplitude of the drive",
        xlim=(excited[0], excited[-1]),
    )
    low, high = axes.get_ylim()
    if low <= 0 or high / low > _DECADES:
        style.log_values(axes)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, columnspacing=1.0)


def zone_points(lattice: Lattice) -> tuple[str, ...]:
    """Names the points on the way round the zone of a lattice, by the angle of its cell."""
    angle = lattice.cell_angle if isinstance(lattice, Kagome) else np.pi / 2
    return ("Γ", "X", "M", "Γ") if abs(np.cos(angle)) < 1e-9 else ("Γ", "M", "K", "Γ")


def bands_panel(axes: Axes, data: xr.Dataset, points: tuple[str, ...]) -> None:
    """Draws the waves of the intact lattice, a colour for each compression."""
    place = data["wave"].values
    handles = []
    shares, laterals = data["compression"].values, data["lateral_strain"].values
    for share, lateral, colour in zip(shares, laterals, _band_colours(len(shares)), strict=True):
        found = data["band_frequency"].sel(compression=share).transpose("wave", "band").values
        axes.plot(place, found / 1000, color=colour, linewidth=0.7)
        words = (
            "at rest"
            if share == 0
            else f"{100 * share:.3g} % shorter, {-100 * lateral:.2g} % narrower"
        )
        handles.append(Line2D([], [], color=colour, label=words))
    axes.set_xticks(range(4), points)
    axes.grid(axis="x", color=style.PALE, linewidth=0.5)
    axes.set(ylabel="frequency (kHz)", xlim=(0, 3), ylim=(min(0.0, axes.get_ylim()[0]), None))
    axes.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(-0.12, 1.0), ncols=2, columnspacing=1.0
    )


def _band_colours(count: int) -> Sequence[str]:
    """Returns a colour for each compression: none that stands for another structure elsewhere."""
    paler = (to_hex(style.MAGNITUDE(place)) for place in np.linspace(0.7, 0.25, max(count - 1, 0)))
    return [style.INTACT, *paler][:count]
