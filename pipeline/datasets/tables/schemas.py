"""Lists the schema of every dataset, as tables of variables with their dims and units."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple

from pipeline.datasets.tables.benchmarks import BENCHMARK, CONTEST, MEASURED, TRACKING
from pipeline.datasets.tables.calibrations import CALIBRATION, WARNED
from pipeline.datasets.tables.comparisons import COMPARED, COMPARISON
from pipeline.datasets.tables.designs import DESIGN, DESIGNMETHOD
from pipeline.datasets.tables.gains import GAINS
from pipeline.datasets.tables.load_cycles import LOAD_CYCLES, RECORDED_CYCLES
from pipeline.datasets.tables.populations import CREDITED, POPULATION
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
    "population",
    "load_cycles",
    "benchmark",
    "contest",
    "tracking",
]


class Schema(NamedTuple):
    """Describes one kind of dataset.

    Attributes:
        table: its variables, in the order in which they are written.
        title: what it holds, in a line; a dataset may have a title of its own.
        attributes: what it tells in attributes of its own, beside its provenance.
    """

    table: Table
    title: str
    attributes: Mapping[str, str] = MappingProxyType({})


SCHEMAS: Mapping[Kind, Schema] = {
    "design": Schema(
        DESIGN,
        "Cloak as designed, with the history of its optimisations",
        {"shipped_method": "the method whose design this is"},
    ),
    "design_method": Schema(
        DESIGNMETHOD, "Cloak as designed by one method, with the history of the optimisation"
    ),
    "response": Schema(RESPONSE, "Motions, forces and energies of the structures, simulated"),
    "sweep": Schema(SWEEP, "Losses of the structures over parameters of the problem"),
    "scatter": Schema(SCATTER, "Responses of imperfect copies of a design"),
    "verification": Schema(
        VERIFICATION, "Results with finer steps and with the other law of contact"
    ),
    "spectrum": Schema(
        SPECTRUM, "Small vibrations of the structures, and waves in their unit cell"
    ),
    "gains": Schema(GAINS, "Losses of designs that hold against more than the study's own drive"),
    "specimen": Schema(SPECIMEN, "Motion of a specimen for a synthetic video, simulated", RECORDED),
    "track": Schema(TRACK, "Motion of every unit in a video, with its uncertainty", RECORDED),
    "truth": Schema(TRUTH, "Motion of every unit that a synthetic video shows", RECORDED),
    "comparison": Schema(COMPARISON, "Motion in a recording beside its simulation", COMPARED),
    "calibration": Schema(
        CALIBRATION, "Constants of a specimen, found from measurements, with their errors", WARNED
    ),
    "population": Schema(
        POPULATION,
        "Constants of several samples, and the test of another that they predict",
        CREDITED,
    ),
    "load_cycles": Schema(
        LOAD_CYCLES, "Load cycles as measured, beside equilibria along the drive", RECORDED_CYCLES
    ),
    "benchmark": Schema(BENCHMARK, "Run time, error and work of several methods", MEASURED),
    "contest": Schema(
        CONTEST, "Optimisers on the same design problem, evaluation by evaluation", MEASURED
    ),
    "tracking": Schema(TRACKING, "Accuracy of tracking against frame rate", MEASURED),
}

TABLES: Mapping[Kind, Table] = {kind: schema.table for kind, schema in SCHEMAS.items()}
"""The variables of each kind of dataset."""
