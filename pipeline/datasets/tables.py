"""The schema of every dataset, as tables: which variables there are, on which dims, in what unit.

Coordinates are those of the specimen frame: origin at the lattice point of unit (0, 0), x to the
right, y up, rotations counter-clockwise; `unit` carries the design's ids.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

SCHEMA_VERSION = 1

Type = Literal["float64", "int64", "int8", "str"]
Kind = Literal[
    "design", "design_method", "response", "sweep", "scatter", "verification", "track", "truth"
]


@dataclass(frozen=True)
class Variable:
    """One variable of a dataset.

    Attributes:
        dims: names of its dimensions.
        units: its unit; "1" for names, ids and ratios.
        long_name: what it is, for people and axes.
        dtype: type in the file.
        gaps: whether NaN is a value it may take (padding, free degrees of freedom, failed cases).
        flags: meanings of its integer values.
        values: all values of a coordinate, in their order.
        subset: whether it may have some of them only.
        also: units of equal right, where the quantity depends on the problem.
        coordinate: whether it labels dimensions.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: Type = "float64"
    gaps: bool = False
    flags: Mapping[str, int] = field(default_factory=dict)
    values: tuple[str, ...] = ()
    subset: bool = False
    also: tuple[str, ...] = ()
    coordinate: bool = False


Table = dict[str, Variable]


def _label(dims: tuple[str, ...], units: str, long_name: str, dtype: Type = "float64") -> Variable:
    return Variable(dims, units, long_name, dtype, coordinate=True)


def _names(dim: str, long_name: str, *values: str) -> Variable:
    return Variable((dim,), "1", long_name, "str", values=values, coordinate=True)


_UNIT: Table = {
    "unit": _label(("unit",), "1", "id of the unit, i + columns j", "int64"),
    "i": _label(("unit",), "1", "column of the unit", "int64"),
    "j": _label(("unit",), "1", "row of the unit", "int64"),
    "xy": _names("xy", "axis of the specimen frame", "x", "y"),
}

_CASE: Table = {
    "direction": _label(("case",), "deg", "direction of the drive"),
}

_NETWORK: Table = {
    "region": Variable(
        ("unit",),
        "1",
        "region of the unit",
        "int8",
        flags={"surroundings": 0, "cloak": 1, "source": 2, "void": 3, "inclusion": 4},
    ),
    "roi": Variable(
        ("unit",),
        "1",
        "whether the unit is in the region of interest",
        "int8",
        flags={"outside": 0, "inside": 1},
    ),
    "support": Variable(
        ("unit",),
        "1",
        "support of the unit",
        "int8",
        flags={"free": 0, "clamped": 1, "driven": 2},
    ),
    "ligament_unit": Variable(
        ("ligament", "end"), "1", "units that the ligament of the intact lattice joins", "int64"
    ),
    "ligament_vertex": Variable(
        ("ligament", "end"), "1", "vertex within the unit at either end of the ligament", "int64"
    ),
}

_SHAPE: Table = {
    "vertices": Variable(
        ("unit", "vertex", "xy"), "mm", "vertices of the design, counter-clockwise", gaps=True
    ),
    "vertices_initial": Variable(
        ("unit", "vertex", "xy"), "mm", "vertices of the intact lattice at the start", gaps=True
    ),
    "centroid": Variable(("unit", "xy"), "mm", "centroid of the unit", gaps=True),
    "constraint": _names("constraint", "kind of constraint"),
    "constraint_units": _label(("constraint",), "1", "unit of the constraint's margin", "str"),
    "constraint_margin": Variable(
        ("constraint",),
        "as in constraint_units",
        "smallest margin to the constraint's limit, negative where violated",
        gaps=True,
    ),
    "smallest_gap": Variable((), "mm", "smallest gap between any two units"),
    "overlaps": Variable((), "1", "number of overlapping pairs of units", "int64"),
}

ENERGY = ("N mm",)

_HISTORY: Table = {
    "evaluation": _label(("evaluation",), "1", "number of the evaluation, from zero", "int64"),
    "loss": Variable(
        ("evaluation",), "1", "loss, weighted mean of the load cases", gaps=True, also=ENERGY
    ),
    "loss_case": Variable(
        ("evaluation", "case"), "1", "loss of the load case", gaps=True, also=ENERGY
    ),
    "violation": Variable(
        ("evaluation",), "1", "largest scaled constraint violation, zero if feasible", gaps=True
    ),
    "accepted": Variable(
        ("evaluation",),
        "1",
        "whether the optimiser went on from this design",
        "int8",
        flags={"rejected": 0, "accepted": 1},
    ),
    "design_vector": Variable(
        ("evaluation", "variable"), "mm", "shifts of the free vertices from the start", gaps=True
    ),
    "best_evaluation": Variable((), "1", "evaluation of the best feasible design", "int64"),
    "best_loss": Variable((), "1", "loss of the best feasible design", also=ENERGY),
    "kkt_residual": Variable(
        (), "1", "residual of the optimality conditions at the best feasible design", gaps=True
    ),
}

_METHOD: Table = {"method": _names("method", "optimisation method")}


def _per_method(table: Table) -> Table:
    return {
        name: variable
        if variable.coordinate
        else replace(variable, dims=("method", *variable.dims))
        for name, variable in table.items()
    }


_RESPONSE_LABELS: Table = {
    "structure": Variable(
        ("structure",),
        "1",
        "structure: intact, altered (void or inclusion, no cloak), cloaked",
        "str",
        values=("intact", "altered", "cloaked"),
        subset=True,
        coordinate=True,
    ),
    "frequency": Variable(("case",), "Hz", "frequency of the drive", gaps=True, coordinate=True),
    "amplitude": Variable(("case",), "mm", "amplitude of the drive", gaps=True, coordinate=True),
    "time": _label(("time",), "s", "time since the start of the drive"),
    "contact_law": _names("contact_law", "law of contact", "angle", "geometric"),
    "dof": _names("dof", "degree of freedom", "ux", "uy", "theta"),
}

_MOTION = ("structure", "case", "time", "unit", "dof")
_STEP = ("structure", "case", "time")
_OF_CASE = ("structure", "case")

_BY_LAW = ("structure", "contact_law", "case")

_RESPONSE: Table = {
    "vertices": Variable(
        ("structure", "unit", "vertex", "xy"),
        "mm",
        "vertices at rest, counter-clockwise",
        gaps=True,
    ),
    "displacement": Variable(
        _MOTION, "mm (ux, uy), rad (theta)", "displacement of the units", gaps=True
    ),
    "velocity": Variable(
        _MOTION, "mm/s (ux, uy), rad/s (theta)", "velocity of the units", gaps=True
    ),
    "reaction_force": Variable(
        _MOTION, "N (ux, uy), N mm (theta)", "force of the supports and drives", gaps=True
    ),
    "drive_displacement": Variable(
        ("case", "time", "xy"), "mm", "displacement of the driven units, mean"
    ),
    "drive_force": Variable((*_STEP, "xy"), "N", "force of the drive on all driven units together"),
    "strain_energy": Variable(_STEP, "N mm", "strain energy of the ligaments"),
    "contact_energy": Variable(_STEP, "N mm", "energy of the contacts"),
    "min_void_angle": Variable(_STEP, "rad", "smallest void angle"),
    "roi_energy": Variable(
        _STEP, "N mm", "strain energy of the ligaments that touch the region of interest"
    ),
    "contact_pairs": Variable(_STEP, "1", "pairs of units in contact", "int64"),
    "max_stretch": Variable(_STEP, "1", "largest |elongation| of a ligament over its length"),
    "max_shear": Variable(_STEP, "rad", "largest |shear angle| of a ligament"),
    "max_bend": Variable(_STEP, "rad", "largest |relative rotation| over a ligament"),
    "gap": Variable(_STEP, "mm", "smallest gap between units, where it was looked for", gaps=True),
    "overlapping": Variable(
        _STEP, "1", "overlapping pairs of units, where they were looked for", gaps=True
    ),
    "stability": Variable(
        _STEP,
        "1",
        "whether a state of equilibrium is a minimum of the energy",
        "int8",
        flags={"not_asked": -1, "unstable": 0, "stable": 1, "stable_after_a_jump": 2},
    ),
    "min_gap": Variable(_OF_CASE, "mm", "smallest gap between units over the history"),
    "overlaps": Variable(_OF_CASE, "1", "overlapping pairs of units over the history", "int64"),
    "loss": Variable(_OF_CASE, "1", "loss: time integral, or over the load steps", also=ENERGY),
    "loss_samples": Variable(
        _OF_CASE, "1", "loss, mean of the samples as the authors plot it", also=ENERGY
    ),
    "loss_error": Variable(
        _OF_CASE, "1", "estimated error of the loss, relative; absolute where it is a ratio itself"
    ),
    "displacement_error": Variable(
        _OF_CASE, "1", "estimated relative error of the displacement in the region of interest"
    ),
    "loss_by_contact": Variable(
        _BY_LAW, "1", "loss under either law of contact, static studies", gaps=True, also=ENERGY
    ),
    "overlaps_by_contact": Variable(
        _BY_LAW,
        "1",
        "overlapping pairs of units over the load steps under either law of contact",
        gaps=True,
    ),
    "gap_by_contact": Variable(
        _BY_LAW, "mm", "smallest gap over the load steps under either law of contact", gaps=True
    ),
}

_MAP = ("direction", "frequency")

_SWEEP: Table = {
    "direction": _label(("direction",), "deg", "direction of the drive"),
    "frequency": _label(("frequency",), "Hz", "frequency of the drive"),
    "loss": Variable(_MAP, "1", "loss of the cloaked structure", gaps=True),
    "loss_altered": Variable(_MAP, "1", "loss of the structure before optimisation", gaps=True),
    "status": Variable(_MAP, "1", "ok, or why the case failed", "str"),
    "min_void_angle": Variable(_MAP, "rad", "smallest void angle of the cloaked case", gaps=True),
}

_COPY = ("noise", "sample")
_PATH_OF_COPY = (*_COPY, "time")

_SCATTER: Table = {
    "noise": _label(("noise",), "1", "kind and size of the imperfection", "str"),
    "sample": _label(("sample",), "1", "number of the copy, from zero", "int64"),
    "time": _label(("time",), "s", "time since the start of the drive"),
    "rotation": Variable(
        _PATH_OF_COPY, "rad", "mean |theta| over the region of interest", gaps=True
    ),
    "departure": Variable(
        _PATH_OF_COPY,
        "1",
        "root mean square over the region of interest of |U - U_target|, U = (ux/s, uy/s, theta)",
        gaps=True,
    ),
    "reaction": Variable(
        _PATH_OF_COPY, "N", "force on all driven units along the drive's direction", gaps=True
    ),
    "loss": Variable(_COPY, "1", "loss, weighted mean of the load cases", gaps=True, also=ENERGY),
    "min_void_angle": Variable(_COPY, "rad", "smallest void angle on the way", gaps=True),
    "clashes": Variable(
        _COPY, "1", "units that overlapped or touched at rest in the first draw", "int64"
    ),
    "redrawn": Variable(_COPY, "1", "shifts drawn again until no units overlapped", "int64"),
    "status": Variable(_COPY, "1", "ok, or why the copy has no result", "str"),
}

_CHECK = ("check", "structure")

_VERIFICATION: Table = {
    "check": _label(("check",), "1", "what was changed; as run comes first", "str"),
    "structure": _RESPONSE_LABELS["structure"],
    "loss": Variable(
        _CHECK,
        "1",
        "loss, mean of the load cases; sums over load steps as if there were as many as run",
        gaps=True,
        also=ENERGY,
    ),
    "departure": Variable(
        _CHECK,
        "mm",
        "largest distance of a unit from where it is as run, at equal loads",
        gaps=True,
    ),
    "min_void_angle": Variable(_CHECK, "rad", "smallest void angle at any load", gaps=True),
    "gap": Variable(_CHECK, "mm", "smallest gap between units at any load", gaps=True),
    "overlaps": Variable(_CHECK, "1", "most overlapping pairs of units at any load", "int64"),
    "contact_pairs": Variable(_CHECK, "1", "pairs of units in contact at the full load", "int64"),
    "unstable": Variable(_CHECK, "1", "loads whose equilibrium is no minimum", "int64"),
    "status": Variable(("check",), "1", "ok, or why there is no result", "str"),
}

_TRACKED = ("time", "unit", "dof")

_TRACK: Table = {
    "time": _label(("time",), "s", "time of the frame since the start of the window"),
    "dof": _RESPONSE_LABELS["dof"],
    "vertices": replace(_SHAPE["vertices"], long_name="vertices at rest, counter-clockwise"),
    "displacement": Variable(
        _TRACKED, "mm (ux, uy), rad (theta)", "displacement of the units", gaps=True
    ),
    "sigma": Variable(
        _TRACKED,
        "mm (ux, uy), rad (theta)",
        "standard uncertainty of the displacement",
        gaps=True,
    ),
    "quality": Variable(
        ("time", "unit"),
        "1",
        "whether the unit was found, or why not",
        "int8",
        flags={
            "good": 0,
            "out_of_frame": 1,
            "hidden": 2,
            "glare": 3,
            "poor_fit": 4,
            "strayed": 5,
            "absent": 6,
        },
    ),
    "timing": Variable(
        ("time",),
        "1",
        "timing of the frame: a duplicate shows the instant before, a frame is missing before",
        "int8",
        flags={"steady": 0, "duplicate": 1, "dropped": 2},
    ),
    "frame": Variable(("time",), "1", "number of the frame in the file, from zero", "int64"),
    "load_force": Variable(
        ("time",), "N", "force of the load cell, where there was one", gaps=True
    ),
    "drive_displacement": Variable(
        ("time", "xy"),
        "mm",
        "displacement of the driven units, mean of those that are seen",
        gaps=True,
        coordinate=True,
    ),
    "camera_homography": Variable(
        ("row", "column"),
        "px, mm",
        "homography from the specimen's plane to undistorted pixels",
        gaps=True,
    ),
    "camera_centre": Variable(("xy",), "px", "centre of the distortion", gaps=True),
    "camera_radial": Variable(
        ("power",),
        "1",
        "distortion at half the image's larger side: square and fourth power",
        gaps=True,
    ),
    "camera_residual": Variable(
        ("unit", "xy"), "px", "first frame: place of the unit less that by design", gaps=True
    ),
    "image_size": Variable(("xy",), "px", "width and height of the image", "int64"),
    "blur": Variable((), "px", "standard deviation of the camera's blur at edges", gaps=True),
}

_SHOWN = (
    "time",
    "dof",
    "vertices",
    "displacement",
    "camera_homography",
    "camera_centre",
    "camera_radial",
    "image_size",
)

_TRUTH: Table = {
    **{name: _TRACK[name] for name in _SHOWN},
    "camera_eye": Variable(("xyz",), "mm", "centre of projection, z towards the camera"),
}

TABLES: Mapping[Kind, Table] = {
    "design": _UNIT | _CASE | _METHOD | _NETWORK | _SHAPE | _per_method(_HISTORY),
    "design_method": _UNIT | _CASE | _NETWORK | _SHAPE | _HISTORY,
    "response": _UNIT | _CASE | _RESPONSE_LABELS | _NETWORK | _RESPONSE,
    "sweep": _SWEEP,
    "scatter": _SCATTER,
    "verification": _VERIFICATION,
    "track": _UNIT | _TRACK,
    "truth": _UNIT | _TRUTH,
}
"""The variables of each kind of dataset, in the order in which they are written."""

_RECORDED = {"recording": "the recording's YAML, as read", "synthetic": "yes if rendered"}

ATTRIBUTES: Mapping[Kind, Mapping[str, str]] = {
    "design": {"shipped_method": "the method whose design this is"},
    "design_method": {},
    "response": {},
    "sweep": {},
    "scatter": {},
    "verification": {},
    "track": _RECORDED,
    "truth": _RECORDED,
}
"""What each kind tells in attributes of its own, beside its provenance."""
