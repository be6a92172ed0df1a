"""Lists variables of simulated motions: of the structures, and of losses over a sweep."""

from __future__ import annotations

from pipeline.datasets.tables.designs import NETWORK
from pipeline.datasets.tables.variables import (
    CASE,
    ENERGY,
    LABELS,
    UNIT,
    Table,
    Variable,
    label,
    names,
)

_MOTION = ("structure", "case", "time", "unit", "dof")
_STEP = ("structure", "case", "time")
_OFCASE = ("structure", "case")

_BY_LAW = ("structure", "contact_law", "case")

RESPONSE: Table = (
    UNIT
    | CASE
    | LABELS
    | NETWORK
    | {
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
        "drive_force": Variable(
            (*_STEP, "xy"), "N", "force of the drive on all driven units together"
        ),
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
        "gap": Variable(
            _STEP, "mm", "smallest gap between units, where it was looked for", gaps=True
        ),
        "overlapping": Variable(
            _STEP, "1", "overlapping pairs of units, where they were looked for", gaps=True
        ),
        "stability": Variable(
            _STEP,
            "1",
            "whether a state of equilibrium is a minimum of the energy",
            "int8",
            flags={
                "not_asked": -1,
                "unstable": 0,
                "stable": 1,
                "stable_after_a_jump": 2,
                "stable_after_a_branching": 3,
            },
        ),
        "snap": Variable(
            _STEP,
            "s",
            "load parameter at which the structure snapped on the way to a load: its path ended",
            gaps=True,
        ),
        "eigenvalue": Variable(
            _STEP,
            "N/mm",
            "smallest eigenvalue of the tangent at fixed supports and drives, rotations times half"
            " a spacing; static studies",
            gaps=True,
        ),
        "min_gap": Variable(_OFCASE, "mm", "smallest gap between units over the history"),
        "overlaps": Variable(_OFCASE, "1", "overlapping pairs of units over the history", "int64"),
        "loss": Variable(_OFCASE, "1", "loss: time integral, or over the load steps", also=ENERGY),
        "loss_other_branch": Variable(
            _OFCASE,
            "1",
            "loss on the other branch where the path of equilibria branches",
            gaps=True,
            also=ENERGY,
        ),
        "loss_samples": Variable(
            _OFCASE, "1", "loss, mean of the samples as the authors plot it", also=ENERGY
        ),
        "loss_error": Variable(
            _OFCASE,
            "1",
            "estimated error of the loss, relative; absolute where it is a ratio itself",
        ),
        "displacement_error": Variable(
            _OFCASE, "1", "estimated relative error of the displacement in the region of interest"
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
        "snaps_by_contact": Variable(
            _BY_LAW,
            "1",
            "ways between load steps on which the structure snaps under either law of contact",
            gaps=True,
        ),
    }
)

_CASE = ("case",)

SWEEP: Table = {
    "case": label(_CASE, "1", "number of the case", "int64"),
    "parameter": names("parameter", "what the cases set: keys of the problem, joined by dots"),
    "parameter_units": label(("parameter",), "1", "unit of the parameter's values", "str"),
    "value": Variable(
        ("case", "parameter"),
        "parameter_units (parameter)",
        "value of a parameter, if a number",
        gaps=True,
    ),
    "setting": Variable(("case", "parameter"), "1", "value of a parameter, in words", "str"),
    "loss": Variable(_CASE, "1", "loss of the cloaked structure", gaps=True, also=ENERGY),
    "loss_altered": Variable(
        _CASE, "1", "loss of the structure before optimisation", gaps=True, also=ENERGY
    ),
    "status": Variable(_CASE, "1", "ok, or why the case failed", "str"),
    "min_void_angle": Variable(_CASE, "rad", "smallest void angle, cloaked structure", gaps=True),
}
