"""Composes the figure of a certificate: losses over the family, motion under the worst load."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from pipeline.posing import greatest_loss, worst_load
from pipeline.problem.sections import SeveralDrives
from reports.base import Table, prose, style
from reports.facts import headed
from reports.figures.loading_path import Abscissa, abscissa_of
from reports.panels import (
    CLAMP_TINT,
    CLOAK_TINT,
    Panel,
    PanelFigure,
    arrow,
    colour_bar,
    draw,
    draw_clamps,
    drive_arrows,
    outline,
    tints,
)
from reports.study import CLAMPED, CLOAK, DRIVEN, RigidUnits, StudyResults, from_dataset
from sim.core import Floats

_PROSE = prose(__file__)
_COLOURS = {"cloaked": style.CLOAKED, "study": style.GREY}
_NAMES = {"cloaked": "this design", "study": "the study's own"}
_AXES = {"frequency": "frequency (Hz)", "amplitude": "amplitude (mm)", "direction": "direction (°)"}
_TURN = 45.0
"""Between ticks of directions, where these span more, degrees."""
_UNIT_TINT = "#c3c7cc"
_MARKERS = "os^Dv"
"""Of the loads in each set-up, over again after the last."""
_TOP, _LOW, _HIGH, _HEIGHT = 11.0, 70.0, 36.0, 119.0


@dataclass(frozen=True)
class CertifiedDesign:
    """Holds a certificate, and the study under the worst load of it."""

    data: xr.Dataset
    worst: StudyResults

    @property
    def harmonic(self) -> bool:
        """Tells whether the loads have a frequency."""
        return bool(self.data["load_frequency"].notnull().all())

    @property
    def setups(self) -> int:
        """Counts the set-ups of supports and drives."""
        return 1 + int(self.data["load_setup"].max())

    @property
    def own(self) -> xr.Dataset:
        """Returns the losses of the design itself."""
        return self.data.sel(design="cloaked")

    @property
    def most(self) -> float:
        """Returns the greatest loss of the design, of all that was tried."""
        return greatest_loss(self.own)

    @property
    def axes(self) -> tuple[str, str]:
        """Names the axis of the map beside the amplitude, and that of the scatter, which varies."""
        across = "frequency" if self.harmonic else "direction"
        order = ("direction", "amplitude") if self.harmonic else ("amplitude", "direction")
        varied = [name for name in order if np.ptp(self.data[f"load_{name}"].values) > 0.0]
        return across, (varied or order)[0]

    @cached_property
    def path(self) -> Abscissa:
        """Returns the course of the worst load: time, or what is applied along its path."""
        return abscissa_of(self.worst.problem, self.worst.response)

    @cached_property
    def size(self) -> xr.DataArray:
        """Returns |U| (structure, time, unit) under the worst load."""
        spacing = self.worst.problem.lattice.spacing
        moved = self.worst.response["displacement"].isel(case=0)
        return _magnitude(moved, spacing)

    @property
    def by_energy(self) -> bool:
        """Tells whether the loss is one of the region's energy."""
        return self.worst.problem.objective.kind == "strain_energy"

    @cached_property
    def missed(self) -> xr.DataArray:
        """Returns what is missed in the region (structure, time), as the loss counts it.

        That is the region's energy, N mm, or the root mean square of displacements in spacings.
        """
        response, problem = self.worst.response, self.worst.problem
        if self.by_energy:
            energy: xr.DataArray = response["roi_energy"].isel(case=0)
            return energy
        moved = response["displacement"].isel(case=0)
        if problem.objective.target == "intact":
            moved = moved - moved.sel(structure="intact")
        size = _magnitude(moved, problem.lattice.spacing)
        inside = size.isel(unit=response["roi"].values.astype(bool))
        found: xr.DataArray = (inside**2).mean("unit") ** 0.5
        return found


def _magnitude(moved: xr.DataArray, spacing: float) -> xr.DataArray:
    scale = xr.DataArray([spacing, spacing, 1.0], dims="dof", coords={"dof": moved["dof"]})
    squares: xr.DataArray = (moved / scale) ** 2
    return squares.sum("dof", skipna=False) ** 0.5


def certificate_figure(found: CertifiedDesign) -> PanelFigure:
    """Returns the whole figure."""
    data = found.data
    measure = "energy" if found.by_energy else found.worst.problem.objective.target
    missed_words = _PROSE["missed"][measure]
    words = {"loads": data.sizes["load"], "along": found.axes[1], "missed": missed_words}

    def losses(figure: Figure) -> None:
        _distribution(style.place(figure, 72.0, _TOP, 41.0, _HIGH), data)

    def loads(figure: Figure) -> None:
        _map(figure, style.place(figure, 129.0, _TOP, 33.0, _HIGH), found)

    def along(figure: Figure) -> None:
        _scatter(style.place(figure, 12.0, _LOW, 41.0, _HIGH), found)

    def missed(figure: Figure) -> None:
        _missed(style.place(figure, 139.0, _LOW, 35.5, _HIGH), found)

    motion = Table("worst_load.csv", "motion under the worst load (panel f)", _series(found))
    heads = {
        "a": ("Design", 0.0, 0.8, lambda figure: _design(figure, found), []),
        "b": ("Loss under random loads", 62.0, 0.8, losses, _tables(data)),
        "c": ("Loss, load by load", 119.0, 0.8, loads, []),
        "d": (f"Loss over {found.axes[1]}", 0.0, _LOW - 10.0, along, []),
        "e": ("Peak under the worst load", 62.0, _LOW - 10.0, lambda f: _peaks(f, found), []),
        "f": ("Under the worst load", 129.0, _LOW - 10.0, missed, [motion]),
    }
    panels = [
        Panel((letter, title, left, top), drawn, _PROSE[letter].format(**words), tables)
        for letter, (title, left, top, drawn, tables) in heads.items()
    ]
    return PanelFigure(_HEIGHT, panels, found.worst.draft)


def _tables(data: xr.Dataset) -> list[Table]:
    def columns(name: str, loss: str) -> dict[str, np.ndarray]:
        """Loads of one kind, a row for each design and load."""
        parts = [f"{name}_{part}" for part in ("setup", "direction", "amplitude", "frequency")]
        parts.append(loss)
        rows = data[["design", *parts]].to_dataframe().reset_index()
        return {"design": rows["design"].to_numpy()} | {
            f"{part} ({data[part].attrs.get('units', '1')})": rows[part].to_numpy()
            for part in parts
        }

    return [
        Table("certificate.csv", "losses under random loads (b to d)", columns("load", "loss")),
        Table("searches.csv", "loads that searches ended at", columns("found", "found_loss")),
    ]


def _series(found: CertifiedDesign) -> dict[str, Floats]:
    columns = {found.path.column: found.path.values}
    for name in _structures(found):
        missed = found.missed.sel(structure=name)
        columns[headed(f"missed_{name}", missed.attrs.get("units", "1"))] = missed.values
    return columns


def _structures(found: CertifiedDesign) -> list[str]:
    return [name for name in ("altered", "cloaked") if name in found.missed["structure"]]


def loss_unit(data: xr.Dataset) -> str:
    """Returns the unit of the losses of a certificate, "1" if they have none."""
    return str(data["loss"].attrs.get("units", "1"))


def _label(data: xr.Dataset) -> str:
    unit = loss_unit(data)
    return "loss" if unit == "1" else f"loss ({unit})"


def _design(figure: Figure, found: CertifiedDesign) -> None:
    axes = style.place(figure, 2.0, 7.0, 44.0, 44.0)
    problem, shown = found.worst.problem, found.worst.response.sel(structure="cloaked")
    structure = from_dataset(shown, problem.lattice.spacing)
    draw_clamps(axes, structure, problem.lattice.spacing)
    held = {CLAMPED: CLAMP_TINT, DRIVEN: style.ALTERED}
    draw(axes, structure, colours=tints(structure, held, {CLOAK: CLOAK_TINT}, _UNIT_TINT))
    _circle(axes, found)
    worst = worst_load(found.data)
    driven = structure.centroid[structure.support == DRIVEN].mean(axis=0)
    reach = 0.75 * problem.lattice.spacing, 2.2 * problem.lattice.spacing
    if found.harmonic:
        drive_arrows(axes, driven, worst["direction"], reach, style.ALTERED)
    elif not isinstance(problem.drive, SeveralDrives):
        angle = np.radians(worst["direction"])
        start, end = (driven + size * np.array([np.cos(angle), np.sin(angle)]) for size in reach)
        arrow(axes, start, end, style.ALTERED, 7.0)
    told = f"worst load: {load_text(found)}"
    style.write(figure, 24.0, 51.0, told, ha="center", fontsize=style.SMALL)


def load_text(found: CertifiedDesign) -> str:
    """Describes the worst load that was found."""
    worst = worst_load(found.data)
    words = [f"{worst['direction']:.3g}°", f"{worst['amplitude']:.3g} mm"]
    words += [f"{worst['frequency']:.3g} Hz"] if found.harmonic else []
    words += [f"set-up {worst['setup'] + 1:.0f}"] if found.setups > 1 else []
    return ", ".join(words)


def _circle(axes: Axes, found: CertifiedDesign) -> None:
    problem = found.worst.problem
    if problem.cloak.bounds is not None and not isinstance(problem.cloak.bounds[0], tuple):
        radii = [radius for radius in problem.cloak.bounds[1:] if radius > 0]
        outline(axes, np.array(problem.lattice.centre_site), radii, style.CLOAKED)


def _distribution(axes: Axes, data: xr.Dataset) -> None:
    for name in data["design"].values[::-1]:
        of, colour = data.sel(design=name), _COLOURS[str(name)]
        ordered = np.sort(of["loss"].values[~np.isnan(of["loss"].values)])
        share = 100 * (1 - np.arange(1, len(ordered) + 1) / len(ordered))
        axes.plot(ordered, share, color=colour, label=_NAMES[str(name)])
        axes.plot(
            of["found_loss"], np.full(data.sizes["search"], 103.0 if name == "cloaked" else 107.0),
            "|", color=colour, markersize=4.0, clip_on=False,
        )  # fmt: skip
        axes.plot(of["nominal_worst"], 0.0, "v", color=colour, markersize=4.0, clip_on=False)
    axes.set(xlabel=_label(data), ylabel="share of the loads above (%)", ylim=(0.0, 100.0))
    axes.set_xlim(left=0.0)
    axes.legend(loc="best")


def _map(figure: Figure, axes: Axes, found: CertifiedDesign) -> None:
    own, across = found.own, found.axes[0]
    order = np.argsort(own["loss"].values)
    norm = Normalize(0.0, found.most)
    for number in range(found.setups):
        marker = _MARKERS[number % len(_MARKERS)]
        of = order[own["load_setup"].values[order] == number]
        axes.scatter(
            own[f"load_{across}"][of], own["load_amplitude"][of], c=own["loss"][of],
            cmap=style.MAGNITUDE, norm=norm, s=5.0, linewidths=0.0, marker=marker,
        )  # fmt: skip
    axes.scatter(
        own[f"found_{across}"], own["found_amplitude"], s=14.0, facecolors="none",
        edgecolors=style.CLOAKED, linewidths=0.7, clip_on=False, zorder=5,
    )  # fmt: skip
    if across == "frequency":
        axes.set_xscale("log")
        low, high = np.round(np.log2(axes.get_xlim())).astype(int)
        axes.set_xticks(octaves := 2.0 ** np.arange(low, high + 1), [f"{f:g}" for f in octaves])
        axes.minorticks_off()
    axes.set(xlabel=_AXES[across], ylabel=_AXES["amplitude"])
    colour_bar(figure, norm, style.MAGNITUDE, (164.5, _TOP, _HIGH), _label(found.data))


def _scatter(axes: Axes, found: CertifiedDesign) -> None:
    along = found.axes[1]
    for name in found.data["design"].values[::-1]:
        of, colour = found.data.sel(design=name), _COLOURS[str(name)]
        axes.plot(
            of[f"load_{along}"], of["loss"], ".", color=colour, markersize=2.0, markeredgewidth=0.0,
            label=_NAMES[str(name)],
        )  # fmt: skip
    axes.set(xlabel=_AXES[along], ylabel=_label(found.data))
    axes.set_ylim(bottom=0.0)
    if along == "direction" and np.ptp(axes.get_xlim()) > 2 * _TURN:
        axes.xaxis.set_major_locator(MultipleLocator(_TURN))


def _peaks(figure: Figure, found: CertifiedDesign) -> None:
    peak = found.size.max("time")
    response, spacing = found.worst.response, found.worst.problem.lattice.spacing
    free = response["support"].values != DRIVEN
    norm = Normalize(0.0, float(peak.isel(unit=free & response["roi"].values.astype(bool)).max()))
    for k, name in enumerate(_structures(found)):
        axes = style.place(figure, 62.0 + 26.5 * k, _LOW + 2.0, 26.0, 26.0)
        structure: RigidUnits = from_dataset(response.sel(structure=name), spacing)
        draw_clamps(axes, structure, spacing)
        values = peak.sel(structure=name).values
        draw(axes, structure, values=values, colour_map=style.MAGNITUDE, norm=norm)
        if name == "cloaked":
            _circle(axes, found)
        colour = style.STRUCTURE_COLOURS[name]
        axes.set_title(name.capitalize(), color=colour, fontsize=style.TEXT, pad=1.5)
    bar = (115.5, _LOW + 2.0, 26.0)
    colour_bar(figure, norm, style.MAGNITUDE, bar, r"$U_\mathrm{peak}$", extend="max")


def _missed(axes: Axes, found: CertifiedDesign) -> None:
    missed = found.missed
    for name in _structures(found):
        colour = style.STRUCTURE_COLOURS[name]
        values = missed.sel(structure=name)
        axes.plot(found.path.values, values, color=colour, label=name.capitalize(), lw=1.0)
    mimics = found.worst.problem.objective.target == "intact"
    size = r"rms of $\|\mathbf{U}-\mathbf{U}^*\|$" if mimics else r"rms of $\|\mathbf{U}\|$"
    path = found.path
    axes.set(xlabel=path.label, ylabel="region's energy (N mm)" if found.by_energy else size)
    axes.set_xlim(path.values[0], path.values[-1])
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, columnspacing=0.8)
