import re
import subprocess
import sys
from pathlib import Path

import cf_units
import netCDF4
import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.datasets import provenance, seal
from pipeline.datasets.tables import SCHEMA_VERSION, TABLES, Kind, Variable
from tests.pipeline.samples import sample

KINDS: tuple[Kind, ...] = tuple(TABLES)
CHECKER = str(Path(sys.executable).with_name("compliance-checker"))
CALENDAR = "check_spatiotemporal_dims_have_coordinate_vars"
"""Asks for dates of any dimension that is called time; ours is the time since a drive's start."""


def written(kind: Kind, folder: Path) -> Path:
    path = folder / f"{kind}.nc"
    origin = provenance.of_recording("{}", {}, synthetic=True)
    datasets.write(sample(kind), path, kind, origin)
    return path


@pytest.mark.slow
def test_a_checker_of_the_conventions_finds_nothing(tmp_path: Path) -> None:
    files = [str(written(kind, tmp_path)) for kind in KINDS]
    strictly = ["--test=cf:1.11", "--criteria=strict", f"--skip-checks={CALENDAR}"]
    ended = subprocess.run(
        [CHECKER, *strictly, *files], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stdout.count("All tests passed!") == len(KINDS), ended.stdout


def spellings(variable: Variable) -> list[str]:
    """The units of a variable, one by one."""
    if variable.unit_attribute == "units":
        return [variable.units, *variable.also]
    return re.findall(r"([^(),]+?) \(", variable.units)


@pytest.mark.parametrize("kind", KINDS)
def test_every_unit_is_one_that_programs_know(kind: Kind) -> None:
    for name, variable in TABLES[kind].items():
        for spelt in spellings(variable):
            if spelt not in TABLES[kind]:  # the name of the variable that holds the units
                assert not cf_units.Unit(spelt.strip()).is_unknown(), name


OLD = {"degree": "deg", "1/mm (columns 0, 1), 1 (column 2)": "px, mm"}
OLD["constraint_units (constraint)"] = "as in constraint_units"
FIRST: tuple[Kind, ...] = KINDS[: KINDS.index("comparison")]
"""The kinds of the first version."""


@pytest.mark.parametrize("kind", FIRST)
def test_a_file_of_the_first_version_is_read(kind: Kind, tmp_path: Path) -> None:
    path = written(kind, tmp_path)
    now = datasets.read(path, kind)
    with netCDF4.Dataset(path, "a") as raw:
        raw.schema_version = 1
        raw.delncattr("title")
        raw.delncattr(seal.ATTRIBUTE)
        for name, variable in raw.variables.items():
            table = TABLES[kind][name]
            pixels = "pixels" in table.long_name and table.units == "1"
            variable.delncattr(table.unit_attribute)
            variable.units = "px" if pixels else OLD.get(table.units, table.units)
    migrated = datasets.read(path, kind)
    xr.testing.assert_identical(migrated, now)
    assert migrated.attrs["schema_version"] == SCHEMA_VERSION == 5


TRACED = ["snap_load", "traced_load", "traced_force", "traced_eigenvalue"]
STABILITY = ["snap", "eigenvalue", "loss_other_branch", "snaps_by_contact"]


@pytest.mark.parametrize(("version", "added"), [(2, [*STABILITY, *TRACED]), (3, TRACED)])
def test_an_older_response_is_read(version: int, added: list[str], tmp_path: Path) -> None:
    """It said less of stability; what it did not say reads NaN."""
    path = written("response", tmp_path)
    with xr.open_dataset(path) as opened:
        old = opened.load().drop_vars(added)
    del old.attrs[seal.ATTRIBUTE]
    old.attrs["schema_version"] = np.int64(version)
    old.to_netcdf(path)
    migrated = datasets.read(path, "response")
    assert all(migrated[name].size and np.isnan(migrated[name]).all() for name in added)
    assert migrated["eigenvalue"].attrs["units"] == "N/mm"
