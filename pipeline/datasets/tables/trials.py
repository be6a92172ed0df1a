"""Lists variables of trials of a design: imperfect copies, finer steps."""

from __future__ import annotations

from pipeline.datasets.tables.variables import ENERGY, LABELS, Table, Variable, label

_COPY = ("noise", "sample")
_PATH_OF_COPY = (*_COPY, "time")

SCATTER: Table = {
    "noise": label(("noise",), "1", "kind and size of the imperfection", "str"),
    "sample": label(("sample",), "1", "number of the copy, from zero", "int64"),
    "time": label(("time",), "s", "time since the start of the drive"),
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

VERIFICATION: Table = {
    "check": label(("check",), "1", "what was changed; as run comes first", "str"),
    "structure": LABELS["structure"],
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
    "error": Variable(
        _CHECK,
        "1",
        "relative error of the displacement in the region of interest over time, against the"
        " intact structure",
        gaps=True,
    ),
    "time_step": Variable(_CHECK, "s", "equal steps of a motion in time", gaps=True),
    "min_void_angle": Variable(_CHECK, "rad", "smallest void angle at any load", gaps=True),
    "gap": Variable(_CHECK, "mm", "smallest gap between units at any load", gaps=True),
    "overlaps": Variable(_CHECK, "1", "most overlapping pairs of units at any load", "int64"),
    "contact_pairs": Variable(
        _CHECK,
        "1",
        "pairs of units in contact at the full load; of a motion in time, at most",
        "int64",
    ),
    "unstable": Variable(_CHECK, "1", "loads whose equilibrium is no minimum", "int64"),
    "status": Variable(("check",), "1", "ok, or why there is no result", "str"),
}
