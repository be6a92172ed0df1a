"""The schema of every dataset, as tables: which variables, on which dims, in what unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pipeline.datasets.tables.benchmarks import BENCHMARK, CONTEST, MEASURED, TRACKING
from pipeline.datasets.tables.calibrations import CALIBRATION, WARNED
from pipeline.datasets.tables.comparisons import COMPARED, COMPARISON
from pipeline.datasets.tables.designs import DESIGN, DESIGNMETHOD
from pipeline.datasets.tables.gains import GAINS
from pipeline.datasets.tables.responses import RESPONSE, SWEEP
from pipeline.datasets.tables.spectra import SPECTRUM
from pipeline.datasets.tables.tracks import RECORDED, SPECIMEN, TRACK, TRUTH
from pipeline.datasets.tables.trials import SCATTER, VERIFICATION
from pipeline.datasets.tables.variables import Table

SCHEMA_VERSION = 2

Kind = Literal[
    "design",
    "design_method",
    "response",
    "sweep",
    "scatter",
    "verification",
    "spectrum",
    "gains",
    "specimen",
    "track",
    "truth",
    "comparison",
    "calibration",
    "benchmark",
    "contest",
    "tracking",
]

TABLES: Mapping[Kind, Table] = {
    "design": DESIGN,
    "design_method": DESIGNMETHOD,
    "response": RESPONSE,
    "sweep": SWEEP,
    "scatter": SCATTER,
    "verification": VERIFICATION,
    "spectrum": SPECTRUM,
    "gains": GAINS,
    "specimen": SPECIMEN,
    "track": TRACK,
    "truth": TRUTH,
    "comparison": COMPARISON,
    "calibration": CALIBRATION,
    "benchmark": BENCHMARK,
    "contest": CONTEST,
    "tracking": TRACKING,
}
"""The variables of each kind of dataset, in the order in which they are written."""

ATTRIBUTES: Mapping[Kind, Mapping[str, str]] = {
    "design": {"shipped_method": "the method whose design this is"},
    "design_method": {},
    "response": {},
    "sweep": {},
    "scatter": {},
    "verification": {},
    "spectrum": {},
    "gains": {},
    "specimen": RECORDED,
    "track": RECORDED,
    "truth": RECORDED,
    "comparison": COMPARED,
    "calibration": WARNED,
    "benchmark": MEASURED,
    "contest": MEASURED,
    "tracking": MEASURED,
}
"""What each kind tells in attributes of its own, beside its provenance."""

TITLES: Mapping[Kind, str] = {
    "design": "Cloak as designed, with the history of its optimisations",
    "design_method": "Cloak as designed by one method, with the history of the optimisation",
    "response": "Motions, forces and energies of the structures, simulated",
    "sweep": "Losses of the structures over parameters of the problem",
    "scatter": "Responses of imperfect copies of a design",
    "verification": "Results with finer steps and with the other law of contact",
    "spectrum": "Small vibrations of the structures, and waves in their unit cell",
    "gains": "Losses of designs that hold against more than the study's own drive",
    "specimen": "Motion of a specimen for a synthetic video, simulated",
    "track": "Motion of every unit in a video, with its uncertainty",
    "truth": "Motion of every unit that a synthetic video shows",
    "comparison": "Motion in a recording beside its simulation",
    "calibration": "Constants of a specimen, found from measurements, with their errors",
    "benchmark": "Run time, error and work of several methods",
    "contest": "Optimisers on the same design problem, evaluation by evaluation",
    "tracking": "Accuracy of tracking against frame rate",
}
"""What each kind holds, in a line; a dataset may have a title of its own."""
