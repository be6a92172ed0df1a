"""Describes the path along which a report shows its structures, and what it shows of them."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from pipeline.problem.sections import (
    Kagome,
    Lattice,
    ListedNetwork,
    selected_units,
    single_drives,
)
from reports.facts import headed, printed
from reports.figures.loading_path.drive_response import driven_displacement
from sim.core import Floats

LOADS = {
    "force": ("Applied force", "$F$", "N", 1.0),
    "torque": ("Applied moment", "$M$", "N mm", 1.0),
    "rotation": ("Applied rotation", r"$\theta$", "°", 180.0 / np.pi),
}
"""Loads that grow in proportion to the load path: name, symbol, unit, and that of the dataset in
it."""
ORDER = ("intact", "altered", "cloaked")
_ALONG = np.cos(np.pi / 4)
"""Of a drive: nearer to the line than to its normal it strains along it, else it shears."""
_NEGLIGIBLE = 1e-4
"""Share of the largest load below which a label calls a load zero."""
SECOND = "Cloaked, no overlap"
"""Label of the design for contact on distance."""


@dataclass(frozen=True)
class Abscissa:
    """Tells where along the path every sample of a response lies.

    `values` (n_times,) is what the first drive grows by (the displacement of the driven units along
    it in mm, a force in N, a moment in N mm, an angle in degrees, either way), or the time in s;
    `strain` is a paper's label of the last value (a fraction of one), `shown` are the samples of
    the snapshots.
    """

    name: str
    symbol: str
    unit: str
    values: Floats
    static: bool
    strain: float | None
    shown: tuple[int, ...]

    @property
    def displaces(self) -> bool:
        """Tells a path along which the driven units are displaced, and not loaded or turned."""
        return self.static and self.unit == "mm"

    @property
    def label(self) -> str:
        """Labels an axis."""
        return f"{self.name} {self.symbol} ({self.unit})"

    @property
    def column(self) -> str:
        """Heads a column of a table."""
        name = "displacement" if self.displaces else self.name.lower().replace(",", "")
        return headed(name.replace(" ", "_"), self.unit)

    def at(self, sample: int) -> str:
        """Returns the value at a sample in words, with the paper's label of it."""
        value = self.values[sample]
        if self.static and abs(value) < _NEGLIGIBLE * float(np.abs(self.values).max()):
            value = 0.0  # a smooth ramp does not begin at nought
        words = printed(f"{value:.3g}", self.unit).replace(" °", "°")
        if self.strain is None:
            return words
        share = 100.0 * self.strain * abs(value / self.values[-1])
        return f"{words} ({share:.2g} %)"


def abscissa_of(problem: Problem, response: xr.Dataset) -> Abscissa:
    """Returns the path of a response."""
    static, kind = problem.static, single_drives(problem.drive)[0].kind
    paper, time = problem.report.paper, response["time"].values
    name, symbol, unit, factor = LOADS.get(kind, ("Applied displacement", "$u$", "mm", 1.0))
    if not static:
        name, symbol, unit, values = "Time", "$t$", "s", time
    elif kind in LOADS:
        most = factor * float(response["amplitude"][0])
        values = abs(most) * time / time[-1]
        name += ", clockwise" if most < 0.0 else ""
    else:
        values = driven_displacement(problem, response).isel(structure=0, case=0).values
    return Abscissa(
        name=name,
        symbol=symbol,
        unit=unit,
        values=values,
        static=static,
        strain=None if paper is None or not static else paper.strain,
        shown=_samples(values, problem.report.snapshots if static else problem.report.instants),
    )


def load_names(problem: Problem, response: xr.Dataset | xr.DataArray) -> tuple[str, ...]:
    """Names the load cases by their angles; those of a slow load at a side by their kind too."""
    angles = response["direction"].values.astype(float)
    if np.isnan(angles).any():
        return tuple(f"load {number + 1}" for number in range(len(angles)))
    kinds = (load_kind(problem, angle) if problem.static else "along" for angle in angles)
    names = [f"{kind} {angle % 360.0:g}°" for kind, angle in zip(kinds, angles, strict=True)]
    if len(set(names)) == len(names):
        return tuple(names)
    # of several drives the first one may be the same in all cases
    return tuple(f"load {number}, {name}" for number, name in enumerate(names, 1))


def load_kind(problem: Problem, angle: float) -> str:
    """Tells compression, extension and shear along an angle (deg) by the side that is driven.

    A drive of units within the lattice is only "along" its angle.
    """
    outward, axis = driven_side(problem)
    if not drives_side(problem):
        return "along"
    turned = np.radians(angle)
    pull = np.sign(outward[axis]) * (np.cos(turned), np.sin(turned))[axis]
    return "compression" if pull < -_ALONG else "extension" if pull > _ALONG else "shear"


def drives_side(problem: Problem) -> bool:
    """Tells units first driven that are nearer to the end of a line through the middle than to it.

    The line is that along which `driven_side` finds them.
    """
    outward, axis = driven_side(problem)
    span = float(np.ptp([site[1 + axis] for site in problem.lattice.sites()]))
    return bool(abs(outward[axis]) > span / 4)


def driven_side(problem: Problem) -> tuple[Floats, int]:
    """Finds the vector (2,) from the middle to the units first driven, and its larger component."""
    first = single_drives(problem.drive)[0]
    sites = {unit: (x, y) for unit, x, y in problem.lattice.sites()}
    driven = [sites[unit] for unit in selected_units(first.units, problem.lattice)]
    outward = np.mean(driven, axis=0) - np.array(list(sites.values())).mean(axis=0)
    return np.asarray(outward), int(np.argmax(np.abs(outward)))


def _samples(values: Floats, wanted: tuple[float, ...]) -> tuple[int, ...]:
    """Returns samples nearest to the wanted values; at thirds of the way where none are."""
    targets = wanted or tuple(np.linspace(values[0], values[-1], 4))
    found = (int(np.argmin(np.abs(values - target))) for target in targets)
    return tuple(dict.fromkeys(found))


def structures(response: xr.Dataset) -> tuple[str, ...]:
    """Returns names of the structures of a response, in the order in which they are shown."""
    held = {str(name) for name in response["structure"].values}
    return tuple(name for name in ORDER if name in held)


def lattice_size(lattice: Lattice) -> str:
    """Tells how many units a lattice has, in words."""
    if isinstance(lattice, ListedNetwork):
        return f"{lattice.n_units}"
    return f"{'2 × ' * isinstance(lattice, Kagome)}{lattice.columns} × {lattice.rows}"
