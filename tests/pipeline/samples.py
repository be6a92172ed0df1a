"""Random datasets that obey their tables."""

from typing import Any

import numpy as np
import xarray as xr

from pipeline.datasets.tables import SCHEMAS, TABLES, Kind, Variable
from tests.tables import tables

SIZES: dict[str, int] = tables("samples")["sizes"]


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


def filled(
    kind: Kind, sizes: dict[str, int], value: float = 0.0, whole: int = 0, **others: float
) -> dict[str, Any]:
    """Every variable of a kind on dimensions of known sizes, constant."""
    return {
        name: (
            variable.dims,
            np.full(
                [sizes[dim] for dim in variable.dims],
                others.get(name, whole if variable.dtype.startswith("int") else value),
            ),
        )
        for name, variable in TABLES[kind].items()
        if not variable.coordinate and set(variable.dims) <= set(sizes)
    }
