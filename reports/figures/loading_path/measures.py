"""Measures how far structures are from what they should do, and their contraction."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from pipeline.comparison import middle_units
from pipeline.problem import Problem
from reports.study import FREE


@dataclass(frozen=True)
class Measure:
    """Describes a number along the path that should be small, of every structure and load case.

    `of` maps a response to (structure, case, time); `symbol` stands on axes, `formula` behind the
    label where it is explained.
    """

    key: str
    label: str
    symbol: str
    unit: str
    of: Callable[[xr.Dataset], xr.DataArray]
    formula: str = ""


def measure_of(problem: Problem) -> Measure:
    """Returns the measure that goes with a problem's objective."""
    scale = scales(problem)
    if problem.objective.kind == "strain_energy":
        symbol = r"Mean $|\theta|$ (°)"
        return Measure("rotation", "Mean |θ| in the region of interest", symbol, "deg", rotation)
    if problem.objective.target == "rest":
        symbol = r"RMS $\|\mathbf{U}\|$"
        return Measure(
            "motion", "RMS |U| in the region of interest", symbol, "1", lambda r: motion(r, scale)
        )
    return Measure(
        "mismatch",
        "Mimicking error",
        "Mimicking error",
        "1",
        lambda r: mismatch(r, scale, problem.static),
        f", ‖U − U₀‖ / {'‖U₀‖ at full load' if problem.static else 'max ‖U₀‖'} over the region of"
        " interest, U₀ that of the intact structure",
    )


def rotation(response: xr.Dataset) -> xr.DataArray:
    """Returns mean |theta| over the region of interest, degrees."""
    turn: xr.DataArray = np.abs(interest(response).sel(dof="theta"))  # type: ignore[assignment]
    mean: xr.DataArray = turn.mean("unit")
    return np.degrees(mean)  # type: ignore[return-value]


def motion(response: xr.Dataset, scale: tuple[float, float, float]) -> xr.DataArray:
    """Returns root mean square of |U|, U = (ux/s, uy/s, theta), over the region of interest."""
    mean: xr.DataArray = squares(interest(response), scale).mean("unit")
    return mean**0.5


def mismatch(
    response: xr.Dataset, scale: tuple[float, float, float], static: bool = True
) -> xr.DataArray:
    """Returns RMS of U - U_intact over the region of interest, over what ``size_of_intact`` is.

    Units that a recording lost count in neither.
    """
    inside = interest(response)
    intact = inside.sel(structure="intact")
    squared = squares(inside - intact, scale)
    apart, seen = squared.mean("unit"), squared.notnull()
    return apart**0.5 / size_of_intact(response, scale, static, seen)


def size_of_intact(
    response: xr.Dataset,
    scale: tuple[float, float, float],
    static: bool = True,
    seen: xr.DataArray | None = None,
) -> xr.DataArray:
    """Finds the RMS of |U_intact| over the region of interest: at the end, most in time.

    It is (case,) over all units, or (..., case) over those `seen` (..., case, unit).
    """
    intact = squares(interest(response).sel(structure="intact", drop=True), scale)
    course = intact.isel(time=[-1] if static else slice(None)).rename(time="instant")
    if seen is None:
        seen = intact.isel(time=0, drop=True).notnull()
    mean = xr.dot(seen.astype(float), course, dim="unit") / seen.sum("unit")
    return mean.max("instant") ** 0.5


def overall(problem: Problem, values: xr.DataArray) -> xr.DataArray:
    """Takes a measure (..., time) at the end of a path; its root mean square of a motion in time.

    A motion in time may end at rest, or where the drive passes through zero.
    """
    if problem.static:
        return values.isel(time=-1)
    mean: xr.DataArray = (values**2).mean("time")
    return mean**0.5


def over_cases(problem: Problem, values: xr.DataArray) -> xr.DataArray:
    """Returns weighted mean over the load cases."""
    weights = xr.DataArray(np.array(problem.drive.case_weights), dims="case")
    return (values * weights).sum("case", skipna=False) / float(weights.sum())


def scales(problem: Problem) -> tuple[float, float, float]:
    """Returns divisors that make (ux, uy, theta) dimensionless: U = (ux/s, uy/s, theta)."""
    return problem.lattice.spacing, problem.lattice.spacing, 1.0


def interest(response: xr.Dataset) -> xr.DataArray:
    """Returns displacements of the units of the region of interest."""
    return response["displacement"].isel(unit=response["roi"].values.astype(bool))


def squares(displacement: xr.DataArray, scale: tuple[float, float, float]) -> xr.DataArray:
    """Returns sum of squares of dimensionless displacements (..., dof); NaN if one is unknown."""
    divisors = xr.DataArray(np.array(scale), dims="dof", coords={"dof": displacement["dof"]})
    return ((displacement / divisors) ** 2).sum("dof", skipna=False)


def contraction(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Finds how much nearer top and bottom units of the lattice's middle half come, mm."""
    top, bottom = (middle_units(problem, side) for side in ("top", "bottom"))
    rise = response["displacement"].sel(dof="uy")
    return rise.sel(unit=bottom).mean("unit") - rise.sel(unit=top).mean("unit")


def contracts_freely(problem: Problem, response: xr.Dataset) -> bool:
    """Tests if what brings these units nearer is lateral: none of them is driven or clamped."""
    units = [unit for side in ("top", "bottom") for unit in middle_units(problem, side)]
    return bool((response["support"].sel(unit=units) == FREE).all())


def reaction_error(force: xr.DataArray) -> xr.DataArray:
    """Computes how far forces of structures are off the intact one's, relative to its last.

    The forces (structure, case, time) may be moments; root mean squares are over the time.
    """
    intact = force.sel(structure="intact")
    squares: xr.DataArray = ((force - intact) ** 2).mean("time")
    return squares**0.5 / abs(intact.isel(time=-1))
