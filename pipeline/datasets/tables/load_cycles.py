"""Lists variables of load cycles: measured ways there and back, their snaps and loops."""

from __future__ import annotations

from pipeline.datasets.tables.variables import Table, Variable, label

_RECORD, _POINT, _SNAP, _LOOP = ("record",), ("point",), ("snap",), ("loop",)
_WAYS = {"closing": 0, "opening": 1}
ROLES = _WAYS | {"equilibrium_closing": 2, "equilibrium_opening": 3}

LOAD_CYCLES: Table = {
    "record": label(_RECORD, "1", "record of the testing machine", "str"),
    "title": label(_RECORD, "1", "record, in words", "str"),
    "play": Variable(_RECORD, "mm", "play of the clamps, as the equilibria are shown"),
    "misfit": Variable(
        _RECORD, "N", "root mean square of the equilibria less the measured ways", gaps=True
    ),
    "jumps": Variable(_RECORD, "1", "jumps of the equilibria over a cycle", gaps=True),
    "record_of_point": Variable(_POINT, "1", "number of the record, from zero", "int64"),
    "role": Variable(_POINT, "1", "way that the point is of", "int8", flags=ROLES),
    "displacement": Variable(_POINT, "mm", "displacement of the machine"),
    "force": Variable(_POINT, "N", "force, mean over the cycles, or of the equilibria"),
    "scatter": Variable(_POINT, "N", "standard deviation over the cycles", gaps=True),
    "record_of_snap": Variable(_SNAP, "1", "number of the record, from zero", "int64"),
    "snap_role": Variable(_SNAP, "1", "way that it is on", "int8", flags=_WAYS),
    "snap_start": Variable(_SNAP, "mm", "displacement where it begins"),
    "snap_peak": Variable(_SNAP, "N", "force there"),
    "snap_end": Variable(_SNAP, "mm", "displacement where it ends"),
    "snap_rest": Variable(_SNAP, "N", "force there"),
    "record_of_loop": Variable(_LOOP, "1", "number of the record, from zero", "int64"),
    "loop_area": Variable(_LOOP, "N mm", "work that a way and the next one take up"),
}

RECORDED_CYCLES = {
    "load_cycles": "the study's YAML, as read",
    "synthetic": "yes if the data were computed",
}
"""Attributes of load cycles."""
