"""Lists variables of calibrations: constants with their errors, and the fit to the data."""

from __future__ import annotations

from pipeline.datasets.tables.variables import Table, Variable, label

_OF = ("parameter",)
_PAIR = ("parameter", "with_parameter")
_SET = ("set",)
_POINT = ("point",)
_STATED = "parameter_units (parameter)"
_VALUE = "N (forces), rad (decays and rotations), mm (displacements)"

CALIBRATION: Table = {
    "parameter": label(_OF, "1", "constant of the specimen", "str"),
    "parameter_units": label(_OF, "1", "unit of the constant", "str"),
    "with_parameter": label(("with_parameter",), "1", "constant of the specimen", "str"),
    "set": label(_SET, "1", "set of measurements", "str"),
    "kind": label(_SET, "1", "kind of the set", "str"),
    "origin": Variable(
        _OF,
        "1",
        "whether it was fitted or follows from others",
        "int8",
        flags={"fitted": 0, "derived": 1},
    ),
    "status": Variable(
        _OF,
        "1",
        "how well the data determine it",
        "int8",
        flags={"determined": 0, "weak": 1, "not_determined": 2, "at_bound": 3},
    ),
    "start": Variable(_OF, _STATED, "value that the fit started from"),
    "value": Variable(_OF, _STATED, "value"),
    "lower": Variable(_OF, _STATED, "lower end of the 95 % interval"),
    "upper": Variable(_OF, _STATED, "upper end of the 95 % interval"),
    "standard_error": Variable(_OF, "1", "standard error of the logarithm of the value"),
    "bound": Variable(
        _OF, "1", "Cramer-Rao bound of the standard error, at the noise and the values found"
    ),
    "covariance": Variable(_PAIR, "1", "covariance of the logarithms of the values"),
    "correlation": Variable(_PAIR, "1", "correlation of the logarithms of the values"),
    "condition": Variable(
        (), "1", "ratio of the axes of the ellipsoid of errors, each in its standard errors"
    ),
    "newton_step": Variable(
        (), "1", "step that Newton's method would still take by the adjoint, in standard errors"
    ),
    "points": Variable(_SET, "1", "measured values", "int64"),
    "freedom": Variable(_SET, "1", "degrees of freedom that the fit leaves"),
    "chi_square": Variable(_SET, "1", "sum of squares of the whitened residuals"),
    "level": Variable(_SET, "1", "factor on the stated noise, 1 where it is known"),
    "autocorrelation": Variable(
        _SET, "1", "correlation of whitened residuals that follow one another"
    ),
    "peak_ratio": Variable(_SET, "1", "damping ratio by the peaks of a free decay", gaps=True),
    "peak_ratio_error": Variable(_SET, "1", "its standard error by the line fit", gaps=True),
    "set_of_point": Variable(_POINT, "1", "number of the set, from zero", "int64"),
    "channel": Variable(_POINT, "1", "course within the set; of a track, 3 unit + dof", "int64"),
    "abscissa": Variable(
        _POINT, "mm (forces), s (decays and tracks)", "displacement of the drive, or time"
    ),
    "measured": Variable(_POINT, _VALUE, "measured value"),
    "fitted": Variable(_POINT, _VALUE, "value by the fit"),
    "sigma": Variable(_POINT, _VALUE, "standard deviation of the noise"),
    "residual": Variable(_POINT, "1", "whitened residual: fitted less measured"),
}

WARNED = {
    "calibration": "the calibration's YAML, as read",
    "synthetic": "yes if the data were computed",
    "warnings": "what a reader should know first, a line each",
}
"""Attributes of a calibration."""
