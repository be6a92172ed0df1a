"""Writes the dataset `calibration`, and the lines that a problem file takes from it."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from pipeline.calibration.estimates import (
    UNDETERMINED,
    Estimate,
    estimate_constants,
    list_warnings,
    measure_quality,
)
from pipeline.calibration.experiments import DecayTest, Experiment
from pipeline.calibration.fit_uncertainty import estimate_errors
from pipeline.calibration.inputs import UNITS, WRITTEN, ConstantName, Constants
from pipeline.calibration.least_squares import Fit
from pipeline.datasets import SYNTHETIC_LABEL
from sim.core import Floats

FRAGMENT = "lay it over the keys of a problem file."
"""Ends the line that heads the lines `material:` of a problem file."""


def assemble_calibration(fit: Fit) -> tuple[xr.Dataset, Estimate]:
    """Assembles the dataset of a fit, and the values in it.

    Raises:
        SimulationError: an equilibrium on the way is not stable.
    """
    known = estimate_errors(fit)
    found, quality = estimate_constants(fit, known), measure_quality(fit)
    experiments, names = fit.model.experiments, list(found.names)
    begin = [fit.model.begin.value(name) for name in found.names]
    fitted = np.arange(len(names)) >= found.n_fitted
    peaks = np.array([_peak_ratio(each) for each in experiments])
    variables = {
        "origin": ("parameter", fitted.astype(np.int8)),
        "status": ("parameter", found.status.astype(np.int8)),
        "start": ("parameter", np.array(begin)),
        "value": ("parameter", found.value),
        "lower": ("parameter", found.low),
        "upper": ("parameter", found.high),
        "standard_error": ("parameter", found.error),
        "bound": ("parameter", found.bound),
        "covariance": (("parameter", "with_parameter"), found.covariance),
        "correlation": (("parameter", "with_parameter"), found.correlation),
        "condition": ((), found.condition),
        "newton_step": ((), known.newton),
        **{field: ("set", values) for field, values in quality._asdict().items()},
        "peak_ratio": ("set", peaks[:, 0]),
        "peak_ratio_error": ("set", peaks[:, 1]),
        **_point_variables(fit),
    }
    labels = {
        "parameter": names,
        "parameter_units": ("parameter", [UNITS[name] for name in found.names]),
        "with_parameter": names,
        "set": [each.measured.name for each in experiments],
        "kind": ("set", [each.measured.kind for each in experiments]),
    }
    advice = list_warnings(fit, found, quality, known.newton)
    made = xr.Dataset(variables, labels)
    return made.assign_attrs(warnings="\n".join(advice)), found


def _peak_ratio(each: Experiment) -> tuple[float, float]:
    return (each.peaks.ratio, each.peaks.error) if isinstance(each, DecayTest) else (np.nan, np.nan)


def _point_variables(fit: Fit) -> dict[str, tuple[str, Floats]]:
    every = [each.measured for each in fit.model.experiments]
    return {
        "set_of_point": ("point", fit.model.set_of_row),
        "channel": ("point", _concatenate([each.channels for each in every])),
        "abscissa": ("point", _concatenate([each.abscissa for each in every])),
        "measured": ("point", _concatenate([each.values for each in every])),
        "fitted": ("point", _concatenate(fit.model.predictions(fit.unknowns))),
        "sigma": (
            "point",
            _concatenate([each.sigma for each in every]) * fit.level[fit.model.set_of_row],
        ),
        "residual": ("point", fit.residual),
    }


def _concatenate(parts: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate(parts)


def material_fragment(fit: Fit, found: Estimate, title: str, *, synthetic: bool) -> str:
    """Writes the lines `material:` of a problem file, with the interval of each fitted value."""
    here = fit.model.constants(fit.unknowns)
    intervals = {
        name: "  # not determined by the data"
        if status == UNDETERMINED
        else f"  # 95 %: {_format(name, low)} to {_format(name, high)}"
        for name, low, high, status in zip(
            found.names, found.low, found.high, found.status, strict=True
        )
    }
    mark = [f"# {SYNTHETIC_LABEL}: found from computed data, not from a specimen."]
    lines = [
        *(mark if synthetic else []),
        f"# {title or 'Calibration'}: {FRAGMENT}",
        "material:",
        f"  density: {here.material.density * 1e9:.6g} kg/m^2",
        *(_line(here, name, intervals) for name in _STIFFNESS),
        "  damping:",
        *(f"  {_line(here, name, intervals)}".replace("damping_", "") for name in _damping(here)),
    ]
    if here.cutoff is not None:
        angle = _line(here, "contact_cutoff", intervals).replace("contact_cutoff", "cutoff_angle")
        lines += ["contact:", angle]
    return "\n".join(lines) + "\n"


_STIFFNESS: tuple[ConstantName, ...] = ("axial_stiffness", "shear_stiffness", "bending_stiffness")


def _damping(here: Constants) -> tuple[ConstantName, ...]:
    by_ratio = here.material.damping.ratio is not None
    return ("damping_ratio",) if by_ratio else ("damping_translation", "damping_rotation")


def _line(here: Constants, name: ConstantName, intervals: dict[ConstantName, str]) -> str:
    return f"  {name}: {_format(name, here.value(name))}{intervals.get(name, '')}"


def _format(name: ConstantName, value: float) -> str:
    unit, factor = WRITTEN[name]
    return f"{value * factor:.6g} {unit}".rstrip()
