"""A package of the six squares, written by the exporters in a second."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import problem
from pipeline.fabrication.files import PackageFolder
from pipeline.fabrication.papers import bill_rows, write_assembly_sheet, write_bill, write_manifest
from pipeline.fabrication.units import build_specimen, network
from pipeline.problem import Problem
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication
from tests.pipeline.fabrication import handmade

PROBLEM = Path(__file__).parents[3] / "experiments/fig2/problem.yaml"


def design() -> xr.Dataset:
    """What the package needs of a design dataset: the six squares, the corner ones clamped."""
    indices = [(i, j) for j in range(handmade.ROWS) for i in range(handmade.COLUMNS)]
    corners = np.stack([handmade.square(i, j) for i, j in indices])
    ends = np.array(handmade.neighbours())
    support = np.zeros(len(indices), dtype=np.int8)
    support[[0, -1]], support[1] = 1, 2
    return xr.Dataset(
        {
            "vertices": (("unit", "vertex", "xy"), corners),
            "vertices_initial": (("unit", "vertex", "xy"), corners),
            "ligament_unit": (("ligament", "end"), ends[:, :, 0]),
            "ligament_vertex": (("ligament", "end"), ends[:, :, 1]),
            "end_angles": (("ligament", "end"), np.full(ends.shape[:2], np.nan)),
            "region": _flags(np.zeros(len(indices), dtype=np.int8), "surroundings void"),
            "support": _flags(support, "free clamped driven"),
        },
        {
            "unit": ("unit", np.arange(len(indices))),
            "i": ("unit", [i for i, _ in indices]),
            "j": ("unit", [j for _, j in indices]),
        },
    )


def _flags(values: np.ndarray, meanings: str) -> tuple[str, np.ndarray, dict[str, object]]:
    numbers = np.arange(len(meanings.split()), dtype=np.int8)
    return ("unit", values, {"flag_values": numbers, "flag_meanings": meanings})


def write(folder: Path, parameters: Mapping[str, object] | None = None) -> Problem:
    """Writes the package into a new folder, with parameters other than the defaults."""
    settings = Fabrication.model_validate(parameters or {}, context=SIM_UNITS)
    posed = problem.load(PROBLEM).model_copy(update={"fabrication": settings})
    net = network(design(), "cloaked")
    specimen = build_specimen(net, settings, ("toy", "cloaked"), Path("design.nc"))
    folder.mkdir(parents=True)
    package = PackageFolder(folder, specimen, posed, str(PROBLEM))
    package.write()
    write_assembly_sheet(folder / "assembly.pdf", specimen, settings)
    printing = (package.contents, package.prints, posed.infill)
    rows = bill_rows(specimen, settings, posed.material.density, *printing)
    write_bill(folder / "bom.csv", rows)
    write_manifest(folder, specimen, posed, PROBLEM)
    return posed
