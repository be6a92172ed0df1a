"""Comparisons in closed form: what was measured is the simulation, a tenth more and with noise."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.datasets.tables import NETWORK, SCHEMAS
from reports.study import StudyResults
from tests.pipeline.samples import filled

GAIN = 1.1
"""Measured over simulated motion."""
BAND = 0.2
"""Half the width of the band, mm or rad."""
LOST = 20
"""Number of a unit that was never found."""


def with_recordings(study: StudyResults, folder: Path, *shown: tuple[str, int]) -> StudyResults:
    """The study with recordings, each of a structure under a load case, written and read back."""
    compared = {}
    for structure, case in shown:
        file = folder / f"{structure}_{case}/comparison.nc"
        made = comparison(study, structure, case)
        about = provenance.of_study(study.problem, "compare") | {"synthetic": "yes"}
        datasets.write(made, file, "comparison", about | {"recording": "{}"})
        compared[file.parent.name] = datasets.read(file, "comparison")
    return dataclasses.replace(study, compared=compared)


def comparison(study: StudyResults, structure: str, case: int) -> xr.Dataset:
    """Every second sample of the response; a static load goes back over the second half."""
    part = study.response.sel(structure=structure).isel(case=case)
    part = part.drop_vars(["structure", "direction", "frequency", "amplitude"], errors="ignore")
    way = list(range(0, part.sizes["time"], 2))
    there = len(way)
    way += way[::-1] if study.problem.static else []
    shown = part.isel(time=way)
    simulated = shown["displacement"].transpose("time", "unit", "dof").values
    measured = GAIN * simulated
    measured[:, LOST] = np.nan
    sizes = {"time": len(way), "unit": simulated.shape[1], "dof": 3, "xy": 2, "vertex": 4}
    sizes |= {"side": 2, "source": 3, "estimate": 3}
    motion = ("time", "unit", "dof")
    turned = np.abs(simulated[..., 2]).mean(axis=1)
    along = np.stack([GAIN * turned, turned, turned])[..., None] * [1.0, 0.9, 1.1]
    spans = np.ptp(np.stack([measured, simulated, simulated]), axis=1)[..., None]
    variables: dict[str, Any] = filled("comparison", sizes, 0.5) | {
        "measured": (motion, measured),
        "simulated": (motion, simulated),
        "nominal": (motion, simulated),
        "residual": (motion, measured - simulated),
        "band_low": (motion, simulated - BAND),
        "band_high": (motion, simulated + BAND),
        "mean_rotation": (("source", "time", "estimate"), along),
        "peak_to_peak": (("source", "unit", "dof", "estimate"), spans * [1.0, 0.95, 1.05]),
        "branch": ("time", np.where(np.arange(len(way)) < there, 1, 2) * study.problem.static),
        "load_force": ("time", np.linspace(0.0, 9.0, len(way))),
        "vertices": part["vertices"],
        **{name: part[name] for name in NETWORK},
    }
    drive = part["drive_displacement"].transpose("time", "xy").values[way]
    coordinates = {name: part[name] for name in ("unit", "i", "j", "xy", "dof")} | {
        "time": 0.1 * np.arange(len(way)) if study.problem.static else shown["time"].values,
        "side": ["simulated", "nominal"],
        "source": ["measured", "simulated", "nominal"],
        "estimate": ["value", "low", "high"],
        "drive_displacement": (("time", "xy"), drive),
    }
    told = dict.fromkeys(SCHEMAS["comparison"].attributes, "told")
    return xr.Dataset(variables, coordinates, told | {"structure": structure, "case": str(case)})
