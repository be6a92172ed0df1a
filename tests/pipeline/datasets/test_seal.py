from pathlib import Path

import netCDF4
import numpy as np
import pytest

from pipeline.datasets import seal
from pipeline.datasets.files import read, write
from pipeline.runtime import UserError
from tests.pipeline.samples import sample
from tests.tables import refused


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    path = tmp_path / "sweep.nc"
    write(sample("sweep"), path, "sweep", {"problem": "{}"})
    return path


def test_no_byte_of_a_dataset_can_be_another(sweep: Path) -> None:
    whole = sweep.read_bytes()
    for place in np.linspace(0, len(whole) - 1, 60, dtype=int):
        sweep.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        with pytest.raises(UserError, match=r"damaged|its seal is missing") as caught:
            read(sweep, "sweep")
        assert caught.value.file == str(sweep)


def test_what_other_software_changed_is_taken_where_it_says_so(sweep: Path) -> None:
    with netCDF4.Dataset(sweep, "a") as raw:
        raw["loss"][0] = 7.0
    assert seal.check_seal(sweep) == "absent"
    with pytest.raises(UserError, match="its seal is missing"):
        read(sweep, "sweep")
    with netCDF4.Dataset(sweep, "a") as raw:
        raw.delncattr(seal.ATTRIBUTE)
    assert float(read(sweep, "sweep")["loss"][0]) == 7.0


def test_a_small_file_cannot_claim_all_memory(tmp_path: Path) -> None:
    path = tmp_path / "huge.nc"
    with netCDF4.Dataset(path, "w") as made:
        made.createDimension("unit", 10**6)
        made.createVariable("vertices", "f8", ("unit", "unit"), chunksizes=(1000, 1000))
    with refused("it would fill 7629394 MiB", file=path):
        read(path, "design")


@pytest.mark.parametrize("version", ["2", [1, 2], 2.5])
def test_a_version_that_is_no_number_is_refused(sweep: Path, version: object) -> None:
    with netCDF4.Dataset(sweep, "a") as raw:
        raw.setncattr("schema_version", version)
    with pytest.raises(UserError, match="none of this workflow's"):
        read(sweep, "sweep")


@pytest.mark.parametrize("place", [0, (1 << 20) - 1, 1 << 20, (3 << 20) + 4])
def test_every_byte_of_a_large_file_is_sealed(place: int, tmp_path: Path) -> None:
    path = tmp_path / "large.bin"
    path.write_bytes(bytes((3 << 20) + 5))
    seal.write_seal(path)
    assert seal.check_seal(path) == "whole"
    with path.open("r+b") as file:
        file.seek(place)
        file.write(b"\1")
    assert seal.check_seal(path) == "broken"
