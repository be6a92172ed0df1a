"""Slender units of optimised designs, each of which once stopped an export."""

import json
from pathlib import Path

import numpy as np
from shapely import Polygon

from pipeline.fabrication.parts import LETTERS, Unit
from pipeline.fabrication.units import UnitNetwork
from pipeline.fabrication.units.slot_candidates import Corner
from pipeline.fabrication.units.specimen_units import build_unit
from pipeline.fabrication.units.unit_bodies import unit_body
from pipeline.problem.sections import Fabrication

FILE = Path(__file__).parents[2] / "data/slender_units.json"
UNITS = {f"{unit['study']} {unit['label']}": unit for unit in json.loads(FILE.read_text("utf-8"))}


def built(name: str, letters: str = LETTERS) -> Unit:
    """The unit beside its neighbours, some of which have grown."""
    data = UNITS[name]
    polygons, labels = {0: Polygon(data["corners"])}, {0: data["label"]}
    net = UnitNetwork((0,), polygons, labels, {0: (0, 0)}, (), (), ())
    slotted = [
        Corner(vertex, number, np.array(along), 2.25)
        for number, (vertex, *along) in enumerate(data["slots"])
    ]
    neighbours = [Polygon(ring) for ring in data["neighbours"]]
    body = unit_body(net, 0, slotted, neighbours, Fabrication(), FILE)
    return build_unit(net, 0, body, Fabrication(), FILE, letters)
