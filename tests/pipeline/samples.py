"""Random datasets that obey their tables."""

import numpy as np
import xarray as xr

from pipeline.datasets.tables import SCHEMAS, TABLES, Kind, Variable

SIZES = {
    "unit": 49,
    "vertex": 4,
    "xy": 2,
    "ligament": 84,
    "end": 2,
    "method": 2,
    "evaluation": 5,
    "case": 4,
    "variable": 80,
    "constraint": 5,
    "structure": 3,
    "time": 11,
    "contact_law": 2,
    "dof": 3,
    "parameter": 2,
    "noise": 2,
    "sample": 4,
    "check": 3,
    "row": 3,
    "column": 3,
    "power": 2,
    "xyz": 3,
    "side": 2,
    "source": 3,
    "estimate": 3,
    "with_parameter": 4,
    "set": 3,
    "point": 20,
    "run": 3,
    "quantity": 3,
    "work": 2,
    "optimiser": 2,
    "video": 2,
    "tracker": 2,
    "thinning": 3,
    "state": 2,
    "mode": 4,
    "excitation": 5,
    "compression": 2,
    "wave": 7,
    "constant": 3,
    "with_constant": 3,
    "test": 3,
    "quantile": 5,
    "factor": 7,
    "step": 6,
    "predicted": 6,
    "simulated_set": 4,
    "left_out": 3,
    "mechanism": 4,
    "record": 2,
    "part": 3,
    "frame": 4,
    "snap": 3,
    "snap_number": 2,
    "traced_point": 9,
    "loop": 2,
    "band": 12,
    "preset": 3,
    "design": 2,
    "load": 5,
    "search": 3,
}


_ATTRIBUTES: dict[str, dict[str, str]] = {
    "design": {"shipped_method": "sqp"},
    "specimen": {"recording": "{}", "synthetic": "yes"},
    "track": {"recording": "{}", "synthetic": "no"},
    "truth": {"recording": "{}", "synthetic": "yes"},
    "comparison": {
        **dict.fromkeys(SCHEMAS["comparison"].attributes, "as told"),
        "recording": "{}",
        "synthetic": "yes",
        "structure": "cloaked",
        "case": "0",
    },
    "calibration": {"calibration": "{}", "synthetic": "no", "warnings": ""},
    "population": {"population": "{}", "synthetic": "no"},
    "load_cycles": {"load_cycles": "{}", "synthetic": "no"},
    "pictures": {"pictures": "{}", "synthetic": "no"},
    "benchmark": dict.fromkeys(SCHEMAS["benchmark"].attributes, "as told"),
    "contest": dict.fromkeys(SCHEMAS["contest"].attributes, "as told"),
    "tracking": dict.fromkeys(SCHEMAS["tracking"].attributes, "as told"),
}


def sample(kind: Kind, seed: int = 0) -> xr.Dataset:
    """A dataset of `kind` without units, names and provenance, as a stage would hand it over."""
    random = np.random.default_rng(seed)
    filled = {
        name: (variable.dims, _values(name, variable, random))
        for name, variable in TABLES[kind].items()
    }
    labels = {name for name, variable in TABLES[kind].items() if variable.coordinate}
    dataset = xr.Dataset(
        {name: value for name, value in filled.items() if name not in labels},
        {name: filled[name] for name in labels},
    )
    return dataset.assign_attrs(_ATTRIBUTES.get(kind, {}))


def _values(name: str, variable: Variable, random: np.random.Generator) -> np.ndarray:
    shape = tuple(SIZES[dim] for dim in variable.dims)
    if variable.values:
        return np.array(variable.values)
    if name == "method" and variable.dims == ("method",):
        return np.array(["sqp", "mma"])
    if variable.dtype == "str":
        return np.array(["überschritten", "ok"])[random.integers(2, size=shape)]
    if variable.dims == (name,):  # the labels of a dimension ascend
        return np.arange(shape[0]).astype(variable.dtype)
    if variable.dtype == "float64":
        return random.normal(size=shape)
    return random.integers(2, size=shape)
