"""Lists variables of populations: constants of several samples, and a prediction with its truth."""

from __future__ import annotations

from pipeline.datasets.tables.variables import Table, Variable, label

_POINT, _AT, _LEFT = ("point",), ("predicted",), ("left_out",)
_BY_TEST = ("quantile", "test")
_STIFFNESS = "N/mm (axial and shear), N mm/rad (bending)"


def _force(long_name: str, *, gaps: bool = False) -> Variable:
    return Variable(_AT, "N", long_name, gaps=gaps)


POPULATION: Table = {
    "constant": label(("constant",), "1", "constant of the ligaments", "str"),
    "with_constant": label(("with_constant",), "1", "constant of the ligaments", "str"),
    "sample": label(("sample",), "1", "sample of the fit", "str"),
    "test": label(("test",), "1", "kind of test of the fit", "str"),
    "quantile": label(("quantile",), "1", "quantile of the posterior"),
    "factor": label(("factor",), "1", "factor on the median of a constant"),
    "mean": Variable(("quantile", "constant"), _STIFFNESS, "mean constant of the population"),
    "spread": Variable(
        ("quantile", "constant"), "1", "standard deviation of the logarithm from sample to sample"
    ),
    "of_sample": Variable(
        ("quantile", "sample", "constant"), _STIFFNESS, "constant of each sample"
    ),
    "discrepancy": Variable(("quantile",), "1", "what the model misses, relative to the force"),
    "mounting": Variable(_BY_TEST, "1", "what a mounting changes, relative to the force"),
    "reading": Variable(_BY_TEST, "1", "error of a reading, relative to the force"),
    "correlation": Variable(
        ("constant", "with_constant"), "1", "correlation of the logarithms of the means"
    ),
    "profile": Variable(
        ("constant", "factor"), "1", "twice the logarithm of the likelihood that is lost"
    ),
    "r_hat": Variable((), "1", "largest ratio of the scatter between chains to that within"),
    "diverging": Variable((), "1", "part of the sampler's trajectories that diverged"),
    "emulator_error": Variable(("test",), "1", "largest relative error of the emulated force"),
    "emulator_error_predicted": Variable(
        (), "1", "largest relative error of the emulated force of the prediction"
    ),
    "curve": Variable(_POINT, "1", "curve that the reading is of", "str"),
    "point_displacement": Variable(_POINT, "mm", "displacement of the grips"),
    "point_force": Variable(_POINT, "N", "force that was read"),
    "fit_displacement": Variable(("test", "step"), "mm", "displacement of the fitted curves"),
    "fit_force": Variable(
        ("test", "sample", "step"), "N", "force by the medians of each sample's constants"
    ),
    "displacement": Variable(_AT, "mm", "displacement of the grips in the predicted test"),
    "measured": _force("force that was measured"),
    "simulated": _force("force that others simulated", gaps=True),
    "median": _force("median of the prediction for a new sample"),
    "low": _force("lower end of the band of 95 % of curves"),
    "high": _force("upper end of the band of 95 % of curves"),
    "doubled_median": _force("median, with priors twice as wide"),
    "doubled_low": _force("lower end, with priors twice as wide"),
    "doubled_high": _force("upper end, with priors twice as wide"),
    "student_low": _force("lower end of Student's interval from the samples alone"),
    "student_high": _force("upper end of Student's interval from the samples alone"),
    "inside": Variable((), "1", "whether the measured curve lies inside as a whole", "int64"),
    "width_to_student": Variable((), "1", "width of the band over that of Student's interval"),
    "covered": Variable(
        ("simulated_set",), "1", "part of new curves inside the band of a simulated set of samples"
    ),
    "relative_width": Variable(
        ("simulated_set",), "1", "width of its band over that of its Student's interval"
    ),
    "without": Variable(_LEFT, "1", "sample or kind of test that the fit leaves out", "str"),
    "left_out_curve": Variable(_LEFT, "1", "curve that is predicted", "str"),
    "left_out_inside": Variable(_LEFT, "1", "whether it lies inside as a whole", "int8"),
    "left_out_half_width": Variable(_LEFT, "1", "half the band, relative to the force"),
    "left_out_deviation": Variable(_LEFT, "1", "mean logarithm of measured over predicted force"),
    "mechanism": Variable(("mechanism",), "1", "physics that the model leaves out", "str"),
    "size": Variable(("mechanism",), "1", "plausible size of it", "str"),
    "explained": Variable(("mechanism",), "1", "part of the residual that it takes away"),
    "explained_alone": Variable(
        ("mechanism",), "1", "the same if it acted in the predicted test alone"
    ),
    "wanted": Variable(("mechanism",), "1", "factor on its size that takes away most"),
    "change": Variable(
        ("mechanism", "predicted"), "1", "change of the logarithm of the predicted force"
    ),
}

CREDITED = {
    "population": "the study's YAML, as read",
    "synthetic": "yes if the data were computed",
}
"""Attributes of a population."""
