"""Lists variables of a design: the network, its shape, the history of its optimisations."""

from __future__ import annotations

from dataclasses import replace

from pipeline.datasets.tables.variables import CASE, ENERGY, UNIT, Table, Variable, label, names

NETWORK: Table = {
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
        ("unit",), "1", "support of the unit", "int8", flags={"free": 0, "clamped": 1, "driven": 2}
    ),
    "ligament_unit": Variable(
        ("ligament", "end"), "1", "units that the ligament of the intact lattice joins", "int64"
    ),
    "ligament_vertex": Variable(
        ("ligament", "end"), "1", "vertex within the unit at either end of the ligament", "int64"
    ),
}

SHAPE: Table = {
    "vertices": Variable(
        ("unit", "vertex", "xy"), "mm", "vertices of the design, counter-clockwise", gaps=True
    ),
    "vertices_initial": Variable(
        ("unit", "vertex", "xy"), "mm", "vertices of the intact lattice at the start", gaps=True
    ),
    "centroid": Variable(("unit", "xy"), "mm", "centroid of the unit", gaps=True),
    "constraint": names("constraint", "kind of constraint"),
    "constraint_units": label(("constraint",), "1", "unit of the constraint's margin", "str"),
    "constraint_margin": Variable(
        ("constraint",),
        "constraint_units (constraint)",
        "smallest margin to the constraint's limit, negative where violated",
        gaps=True,
    ),
    "smallest_gap": Variable((), "mm", "smallest gap between any two units"),
    "overlaps": Variable((), "1", "number of overlapping pairs of units", "int64"),
}

HISTORY: Table = {
    "evaluation": label(("evaluation",), "1", "number of the evaluation, from zero", "int64"),
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

METHOD: Table = {"method": names("method", "optimisation method")}


def _per_method(table: Table) -> Table:
    return {
        name: variable
        if variable.coordinate
        else replace(variable, dims=("method", *variable.dims))
        for name, variable in table.items()
    }


DESIGN: Table = UNIT | CASE | METHOD | NETWORK | SHAPE | _per_method(HISTORY)
DESIGNMETHOD: Table = UNIT | CASE | NETWORK | SHAPE | HISTORY
