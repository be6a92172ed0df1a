import errno
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.datasets import seal
from pipeline.datasets.files import SchemaError, read, write
from pipeline.datasets.tables import SCHEMA_VERSION, TABLES, Kind
from pipeline.runtime import UserError
from pipeline.runtime import atomic_write as whole
from tests.pipeline.samples import sample
from tests.tables import refused

KINDS: tuple[Kind, ...] = tuple(TABLES)
ORIGIN = {"problem": "{}", "problem_hash": "0" * 64}


def names(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()]


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    path = tmp_path / "sweep.nc"
    write(sample("sweep"), path, "sweep", ORIGIN)
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_read_here_and_elsewhere(kind: Kind, tmp_path: Path) -> None:
    dataset, path = sample(kind), tmp_path / "new folder" / "file.nc"
    write(dataset, path, kind, ORIGIN)
    back = read(path, kind)
    xr.testing.assert_equal(back, dataset)
    assert back.attrs["schema_version"] == SCHEMA_VERSION
    assert back.attrs["problem_hash"] == ORIGIN["problem_hash"]
    assert names(path.parent) == ["file.nc"]
    with xr.open_dataset(path) as opened:
        xr.testing.assert_equal(opened.load(), dataset)
    with netCDF4.Dataset(path) as raw:
        for name, variable in raw.variables.items():
            table = TABLES[kind][name]
            assert variable.getncattr(table.unit_attribute) == table.units
            assert variable.long_name
            if table.flags:
                assert len(variable.flag_values) == len(variable.flag_meanings.split())


WRITER = """
import sys, time
from pathlib import Path
from pipeline.datasets import write
from tests.pipeline.samples import sample
for kind, name in (("design", "a.nc"), ("response", "b.nc")):
    write(sample(kind), Path(sys.argv[1]) / name, kind, {"problem": "{}"})
"""


def test_the_same_data_make_the_same_bytes_in_any_order(tmp_path: Path) -> None:
    """Whatever the second, the process, the folder and the seed of Python's hashes."""
    for seed in "12":
        subprocess.run(
            [sys.executable, "-c", WRITER, str(tmp_path / seed)],
            env={**os.environ, "PYTHONHASHSEED": seed},
            check=True,
        )
    for name in ("a.nc", "b.nc"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()
    dataset = sample("sweep").assign_attrs(a="1", b="2")
    turned = xr.Dataset(
        {name: dataset[name] for name in reversed(list(dataset.data_vars))},
        attrs=dict(reversed(dataset.attrs.items())),
    )
    write(dataset, tmp_path / "a.nc", "sweep", ORIGIN)
    write(turned, tmp_path / "b.nc", "sweep", ORIGIN)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_floats_survive_exactly(seed: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    random = np.random.default_rng(seed)
    dataset = sample("sweep")
    bits = random.integers(0, 2**64, size=dataset["loss"].shape, dtype=np.uint64)
    floats = bits.view(np.float64)
    dataset["loss"].values[...] = np.where(np.isfinite(floats), floats, np.nan)
    path = tmp_path_factory.mktemp("floats") / "sweep.nc"
    write(dataset, path, "sweep", ORIGIN)
    np.testing.assert_array_equal(read(path, "sweep")["loss"], dataset["loss"])


Spoil = Callable[[xr.Dataset], xr.Dataset]

SPOILT: list[tuple[Spoil, str, str]] = [
    (lambda d: d.drop_vars("loss"), "loss", "the variable is missing"),
    (lambda d: d.drop_vars("direction"), "direction", "the variable is missing"),
    (lambda d: d.assign(extra=("new", [1.0])), "extra", "no such variable"),
    (lambda d: d.assign(loss=d["loss"].T), "loss", "its dims are not (structure, case)"),
    (lambda d: d.assign(loss=d["loss"].assign_attrs(units="mm")), "loss", "its unit is not '1'"),
    (lambda d: d.assign(loss=d["loss"] * np.nan), "loss", "NaN where every value is needed"),
    (lambda d: d.assign(loss=d["loss"] * np.inf), "loss", "infinite values"),
    (lambda d: d.assign(overlaps=d["overlaps"] * 0.5), "overlaps", "its type is not int64"),
    (lambda d: d.assign(roi=d["roi"] + 7), "roi", "a flag has no meaning (0 outside, 1 inside)"),
    (lambda d: d.assign_coords(dof=["x", "y", "z"]), "dof", "its values are not (ux, uy, theta)"),
]


@pytest.mark.parametrize(("spoil", "name", "what"), SPOILT, ids=[what for *_, what in SPOILT])
def test_spoilt_data_are_refused(spoil: Spoil, name: str, what: str, tmp_path: Path) -> None:
    path = tmp_path / "response.nc"
    with pytest.raises(SchemaError) as caught:
        write(spoil(sample("response")), path, "response", ORIGIN)
    assert f"response dataset, {name}: " in str(caught.value)
    assert what in str(caught.value)
    assert not names(tmp_path)
    write(sample("response"), path, "response", ORIGIN)
    spoilt = spoil(read(path, "response"))
    spoilt.to_netcdf(path)
    with refused(what, name, "run the stage", path):
        read(path, "response")


def test_the_shipped_method_must_be_told(tmp_path: Path) -> None:
    dataset = sample("design")
    del dataset.attrs["shipped_method"]
    with pytest.raises(SchemaError, match="shipped_method: the attribute is missing"):
        write(dataset, tmp_path / "design.nc", "design", ORIGIN)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(share: float, sweep: Path) -> None:
    whole = sweep.read_bytes()
    sweep.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(UserError, match=r"not a readable netCDF|its seal is missing") as caught:
        read(sweep, "sweep")
    assert caught.value.file == str(sweep)


def test_a_foreign_or_missing_file_is_refused(tmp_path: Path) -> None:
    foreign = tmp_path / "ocean.nc"
    xr.Dataset({"salinity": ("depth", [35.0])}).to_netcdf(foreign)
    with refused("none of this workflow's"):
        read(foreign, "sweep")
    text = tmp_path / "text.nc"
    text.write_text("no netCDF", encoding="utf-8")
    with refused("not a readable netCDF file", remedy="delete it and run"):
        read(text, "sweep")
    film = tmp_path / "film.mp4"
    film.write_bytes(b"the user's own")
    with refused("not a readable netCDF file", remedy="give a dataset") as caught:
        read(film, "sweep")
    assert "delete" not in str(caught.value.remedy)
    with refused("no such dataset", remedy="run the stage"):
        read(tmp_path / "sweep.nc", "sweep")
    with refused("", file=text / "sweep.nc"):
        write(sample("sweep"), text / "sweep.nc", "sweep", ORIGIN)


def test_a_dataset_of_another_kind_or_version_is_refused(sweep: Path) -> None:
    with refused("a design dataset is wanted") as caught:
        read(sweep, "design")
    assert caught.value.value == "sweep"
    with netCDF4.Dataset(sweep, "a") as raw:
        raw.kind = "design_method"
    with refused("a design dataset is wanted", remedy="python -m pipeline select"):
        read(sweep, "design")
    with netCDF4.Dataset(sweep, "a") as raw:
        raw.kind = "sweep"
    for version, remedy in ((SCHEMA_VERSION + 1, "update this software"), (0, "delete it and run")):
        with netCDF4.Dataset(sweep, "a") as raw:
            raw.schema_version = version
        with refused("schema version", remedy=remedy):
            read(sweep, "sweep")


@pytest.mark.parametrize(
    ("number", "what"),
    [
        (errno.ENOSPC, "the disk is full"),
        (errno.EROFS, "the file system is read-only"),
        (errno.EACCES, "no permission"),
    ],
)
def test_a_refused_write_leaves_the_old_file(
    number: int, what: str, sweep: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = sweep.read_bytes()

    def refuse(path: Path) -> None:
        del path
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(whole, "sync", refuse)
    with refused(what, file=sweep):
        write(sample("sweep", seed=1), sweep, "sweep", ORIGIN)
    assert sweep.read_bytes() == before
    assert names(sweep.parent) == [sweep.name]


LIMITED = """
import resource, signal, sys
from pipeline.datasets import write
from pipeline.runtime.errors import UserError
from tests.pipeline.samples import sample
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    write(sample("design"), sys.argv[1], "design", {"problem": "{}"})
except UserError as error:
    print(error.what, error.file, sep="|")
"""


def test_a_write_that_fails_halfway_is_told_and_leaves_nothing(tmp_path: Path) -> None:
    """Past the limit of file sizes the HDF5 library fails just as on a full disk."""
    command = [sys.executable, "-c", LIMITED, str(tmp_path / "design.nc")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    told = f"the file would be too large|{tmp_path / 'design.nc'}"
    assert done.stdout.strip() == told, done.stderr
    assert not names(tmp_path)


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
