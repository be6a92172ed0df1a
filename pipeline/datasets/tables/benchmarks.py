"""Lists variables of benchmarks: times, errors and work of methods, point by point."""

from __future__ import annotations

from pipeline.datasets.tables.variables import ENERGY, LABELS, Table, Variable, label, names

_RUN = ("point", "run")

BENCHMARK: Table = {
    "quantity": names("quantity", "result whose error is told"),
    "work": names("work", "kind of work that is counted"),
    "method": names("point", "method"),
    "setting": names("point", "its tolerance, step or size"),
    "task": names("point", "what was computed: the loss alone, or with its gradient"),
    "units": label(("point",), "1", "number of units of the lattice", "int64"),
    "own": Variable(("point",), "1", "whose method it is", "int8", flags={"baseline": 0, "own": 1}),
    "cpu_time": Variable(_RUN, "s", "processor time of a run, one core", gaps=True),
    "wall_time": Variable(_RUN, "s", "time of a run by the clock", gaps=True),
    "compile_time": Variable(
        ("point",), "s", "time to build, compile and warm up, by the clock", gaps=True
    ),
    "memory": Variable(("point",), "byte", "peak resident memory of the process", gaps=True),
    "error": Variable(
        ("point", "quantity"), "1", "relative l2 error against the reference", gaps=True
    ),
    "count": Variable(("point", "work"), "1", "work done by one run of the loss", gaps=True),
    "outcome": Variable(("point",), "1", "measured, or why not", "str"),
}

_COURSE = ("optimiser", "evaluation")

CONTEST: Table = {
    "optimiser": names("optimiser", "optimiser"),
    "loss": Variable(_COURSE, "1", "loss as evaluated", gaps=True, also=ENERGY),
    "violation": Variable(_COURSE, "mm", "largest constraint violation", gaps=True),
    "cpu_time": Variable(_COURSE, "s", "processor time since the start, one core", gaps=True),
    "best_loss": Variable(
        _COURSE, "1", "loss of the best feasible design so far", gaps=True, also=ENERGY
    ),
    "kkt_residual": Variable(
        _COURSE, "mm", "projected gradient at the best feasible design so far", gaps=True
    ),
    "final_loss": Variable(
        ("optimiser",), "1", "loss of the best design, evaluated afresh", gaps=True, also=ENERGY
    ),
    "outcome": Variable(("optimiser",), "1", "measured, or why not", "str"),
}

_TRACKED = ("video", "tracker", "thinning")

TRACKING: Table = {
    "video": names("video", "video with known truth"),
    "tracker": names("tracker", "way to track"),
    "thinning": label(("thinning",), "1", "every so manyth frame is kept", "int64"),
    "dof": LABELS["dof"],
    "frame_rate": Variable(("video", "thinning"), "Hz", "rate of the frames that are kept"),
    "error": Variable(
        (*_TRACKED, "dof"),
        "mm (ux, uy), rad (theta)",
        "root mean square error over units and frames",
        gaps=True,
    ),
    "lost": Variable(_TRACKED, "1", "share of the poses that were not found"),
    "cpu_time": Variable(_TRACKED, "s", "processor time of a frame, one core"),
}

MEASURED = {
    "machine": "where and when it was measured, from which sources, as JSON",
    "reference": "what the errors are measured against",
    "subject": "what one run computes",
}
"""Attributes of a benchmark. Its times are of one machine: it is not byte-reproducible."""
