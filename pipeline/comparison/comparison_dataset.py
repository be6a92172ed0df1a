"""Assembles a comparison: both sides at the frames, metrics, and their alignment."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pipeline.comparison import curves
from pipeline.comparison.compared_quantities import TRACKED_QUANTITIES, Quantity, known_mean
from pipeline.comparison.curves import Sides
from pipeline.comparison.measured_side import Measurement
from pipeline.comparison.metrics import COPIES, LEVEL, METRICS, Pair, estimate_metrics
from pipeline.comparison.nominal_side import ComparisonAxis, NominalSide
from pipeline.comparison.simulated_side import SimulatedSide
from pipeline.datasets.tables import NETWORK
from pipeline.problem import Problem

SEED = 0

_MOTION = ("time", "unit", "dof")
_OF_SIDE = ("side", "dof", "estimate")
Variables = dict[str, tuple[Any, ...]]

_BY_TIME = (
    "cross-correlation of the measured and the nominal motion of the driven units, refined below a"
    " frame by golden section"
)
_BY_LOAD = (
    "equal displacement of the driven units along the drive is equal load, both on the way there"
    " and back"
)
_AMBIGUOUS = "; other lags are as good: the nearest to the video's start was taken"
_DRIVING = (
    "each degree of freedom of the driven and clamped units by a smoothing spline that departs from"
    " the track by its standard uncertainty"
)


class Compared(NamedTuple):
    """Holds all parts of a comparison."""

    measurement: Measurement  # the measured side
    axis: ComparisonAxis  # time or load
    simulation: SimulatedSide  # under the measured motion, with its imperfect copies
    nominal: NominalSide  # as the problem says
    quantities: dict[str, Quantity]  # what is followed, by its name
    design: xr.Dataset  # as built
    frequency: float  # of the drive, Hz; NaN without
    level: float  # part of the copies in a band
    pixel: tuple[float, float]  # size of a pixel as calibrated and as stated, mm

    @property
    def sides(self) -> Sides:
        """Both simulations and what was measured, NaN where there is nothing to compare."""
        measured, sigma = self.measurement.displacement, self.measurement.sigma
        simulated, copies = self.simulation.displacement, self.simulation.copies
        return Sides(measured, sigma, simulated, self.nominal.displacement, copies, self.level)


def assemble_comparison(made: Compared) -> xr.Dataset:
    """Assembles the dataset ``comparison``, without its attributes."""
    random = np.random.default_rng(SEED)
    design, axis, measurement = made.design, made.axis, made.measurement
    lag = 0.0 if axis.lag is None else axis.lag.value
    coordinates = {
        **{name: design[name] for name in ("unit", "i", "j", "xy")},
        "time": (("time",), measurement.time - lag),
        "dof": (("dof",), ["ux", "uy", "theta"]),
        "side": (("side",), ["simulated", "nominal"]),
        "source": (("source",), ["measured", "simulated", "nominal"]),
        "estimate": (("estimate",), ["value", "low", "high"]),
        "drive_displacement": (("time", "xy"), measurement.drive),
    }
    variables = {
        **{name: design[name] for name in (*NETWORK, "vertices")},
        **_motions(made),
        **_metrics(made, random),
        **_curves(made, random),
        **_alignment(made),
    }
    return xr.Dataset(variables, coordinates)


def _motions(made: Compared) -> Variables:
    measurement, simulation, sides = made.measurement, made.simulation, made.sides
    band = sides.within(sides.copies)
    forces = sides.within(simulation.force_copies)
    quality = measurement.track["quality"].values[measurement.frames]
    motions = {
        "measured": sides.measured,
        "measured_sigma": sides.sigma,
        "simulated": sides.simulated,
        "nominal": sides.nominal,
        "residual": sides.measured - sides.simulated,
        "band_low": band[0],
        "band_high": band[2],
    }
    courses = {
        "branch": made.axis.branch,
        "frame": measurement.track["frame"].values[measurement.frames],
        "load_force": measurement.force,
        "simulated_force": simulation.force,
        "nominal_force": made.nominal.force,
        "force_low": forces[0],
        "force_high": forces[2],
    }
    inside = measurement.compared
    compared = sides._replace(measured=np.where(inside[:, None], sides.measured, np.nan))
    return {
        **{name: (_MOTION, values) for name, values in motions.items()},
        **{name: (("time",), values) for name, values in courses.items()},
        "quality": (("time", "unit"), quality),
        "use": (("unit",), measurement.use),
        "nominal_drive": (("time", "xy"), made.nominal.drive),
        "band_coverage": (("dof",), curves.band_coverage(compared, band)),
        "band_coverage_usual": (
            ("dof",),
            curves.expected_coverage(sides.copies[:, :, inside], band[:, :, inside], sides.level),
        ),
        "band_samples": ((), len(sides.copies)),
    }


def _metrics(made: Compared, random: np.random.Generator) -> Variables:
    sides, inside = made.sides, made.measurement.compared
    time = None if made.axis.lag is None else made.measurement.time
    pairs = [
        Pair(sides.measured[:, inside], motion[:, inside], sides.sigma[:, inside])
        for motion in sides.motions[1:]
    ]
    found = np.stack([estimate_metrics(pair, time, random) for pair in pairs])
    table: Variables = {
        name: (_OF_SIDE, np.moveaxis(found[:, :, place], 1, -1))
        for place, name in enumerate(METRICS)
    }
    table["phase_lag"] = (_OF_SIDE, 2 * np.pi * made.frequency * table["time_shift"][1])
    apart = np.stack([sides.measured - motion for motion in sides.motions[1:]])
    apart[:, :, ~inside] = np.nan
    return {
        **table,
        **_forces(made, random),
        "rmse_map": (("side", "unit", "dof"), np.sqrt(known_mean(apart**2, axis=1))),
    }


def _forces(made: Compared, random: np.random.Generator) -> Variables:
    """Computes errors of the forces against the load cell; its noise is in their scatter."""
    measured = made.measurement.force[:, None, None]
    still = np.zeros_like(measured)
    sides = (made.simulation.force, made.nominal.force)
    pairs = [Pair(measured, force[:, None, None], still) for force in sides]
    found = np.stack([estimate_metrics(pair, None, random)[..., 0] for pair in pairs])
    names = {"force_rmse": "rmse", "force_nrmse": "nrmse"}
    return {
        name: (("side", "estimate"), found[:, :, METRICS.index(metric)])
        for name, metric in names.items()
    }


def _curves(made: Compared, random: np.random.Generator) -> Variables:
    sides, along = made.sides, ("source", "time", "estimate")
    smooth = curves.smooth_motion(sides)
    nothing = np.full((3, len(sides.measured), 3), np.nan)
    followed = {
        name: curves.quantity_curve(sides, smooth, made.quantities[name], random)
        if name in made.quantities
        else nothing
        for name in TRACKED_QUANTITIES
    }
    return {
        **{name: (along, values) for name, values in followed.items()},
        "peak_to_peak": (
            ("source", "unit", "dof", "estimate"),
            curves.estimate_peaks(sides, smooth, random),
        ),
    }


def _alignment(made: Compared) -> Variables:
    found, lag = made.measurement.registration, made.axis.lag
    calibrated, stated = made.pixel
    kept = ("rotation", "rotation_sigma", "scale", "scale_sigma", "residual")
    drive = ("time_lag", "time_lag_sigma", "drive_correlation", "drive_gain", "drive_gain_sigma")
    scalars = {
        **{f"registration_{name}": getattr(found, name) for name in kept},
        "pixel_size": calibrated,
        "pixel_size_stated": stated,
        **dict(zip(drive, (np.nan,) * 5 if lag is None else lag[:5], strict=True)),
        "drive_turn": made.axis.turn,
    }
    return {
        **{name: ((), value) for name, value in scalars.items()},
        "registration_shift": (("xy",), found.shift),
        "registration_shift_sigma": (("xy",), found.shift_sigma),
    }


def describe_comparison(asked: Problem, made: Compared) -> dict[str, str]:
    """Describes in words how the sides were brought together, and how the band was drawn."""
    lag = made.axis.lag
    ambiguous = lag is not None and lag.ambiguous
    return {
        "axis": "load" if lag is None else "time",
        "alignment": (_BY_LOAD if lag is None else _BY_TIME) + (_AMBIGUOUS if ambiguous else ""),
        "resampling": _resampling(made),
        "driving": _DRIVING,
        "band": _band(asked, made),
        "bootstrap": f"{COPIES} copies over units and blocks of frames, with the measurement's"
        f" noise; {100 * LEVEL:g} % intervals; seed {SEED}",
    }


def _resampling(made: Compared) -> str:
    kept, whole = len(made.measurement.frames), made.measurement.track.sizes["time"]
    return (
        f"none of the measurement ({kept} of {whole} frames); the redriven simulation is asked for"
        " at the frames; the response of the study is a cubic spline through its samples"
    )


def _band(asked: Problem, made: Compared) -> str:
    shares = asked.tolerances.model_dump(exclude={"assembly"})
    sizes = ", ".join(f"{name} {size:g}" for name, size in shares.items())
    off = asked.tolerances.assembly
    places = f"assembly {off.shift:g} mm and {np.rad2deg(off.turn):.2g} deg"
    samples = len(made.simulation.copies)
    return (
        f"{100 * made.level:g} % of {samples} imperfect copies ({sizes}, {places}), at each instant"
    )
