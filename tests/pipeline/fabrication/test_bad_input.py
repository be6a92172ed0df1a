from collections.abc import Callable
from pathlib import Path

import pytest
import xarray as xr
import yaml

from pipeline import datasets
from pipeline.datasets.tables import Kind
from tests.pipeline.conftest import Failing
from tests.pipeline.fabrication import built
from tests.tables import tables

Edit = Callable[[Path], None]


def parameters(**values: object) -> Edit:

    def edit(folder: Path) -> None:
        path = folder / "problem.yaml"
        problem = yaml.safe_load(path.read_text(encoding="utf-8"))
        path.write_text(yaml.safe_dump(problem | {"fabrication": values}), encoding="utf-8")

    return edit


def cut_short(folder: Path) -> None:
    path = folder / "design.nc"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def overlapping(folder: Path) -> None:
    design = built.design()
    design["vertices"][1] += [-3.0, 0.0]
    design.to_netcdf(folder / "design.nc")


def turned_inside_out(folder: Path) -> None:
    design = built.design()
    design["vertices"][1, 1] += [5.0, -14.0]
    design.to_netcdf(folder / "design.nc")


def sharing_a_vertex(folder: Path) -> None:
    """The ligament of A1 and A2 begins where that of A1 and B1 does."""
    design = built.design()
    design["ligament_vertex"][1, 0] = 0
    design.to_netcdf(folder / "design.nc")


BROKEN: dict[str, tuple[Edit, list[str]]] = {
    "overlap": (overlapping, ["the units A1 and B1 overlap", "constraints.gap"]),
    "inside out": (turned_inside_out, ["the outline of unit B1 crosses itself", "constraints"]),
    "one vertex": (
        sharing_a_vertex,
        ["the ligaments A1 - B1 and A1 - A2 end at one vertex of unit A1, 0", "ligament_vertex"],
    ),
    "cut short": (cut_short, ["design.nc"]),
}
MISTAKES = BROKEN | {
    name: (parameters(**values), told)
    for name, (values, told) in tables("fabrication")["mistakes"].items()
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A problem and a design that are right, until one of them is edited."""
    (tmp_path / "problem.yaml").write_bytes(built.PROBLEM.read_bytes())
    built.design().to_netcdf(tmp_path / "design.nc")
    whole = datasets.read

    def read(path: Path, kind: Kind) -> xr.Dataset:
        """The small design lacks what only the optimiser writes."""
        try:
            return xr.load_dataset(path)
        except (OSError, ValueError):
            return whole(path, kind)

    monkeypatch.setattr(datasets, "read", read)
    return tmp_path


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told(folder: Path, failing: Failing, name: str) -> None:
    edit, expected = MISTAKES[name]
    edit(folder)
    out = folder / "fabrication/cloaked"
    words = ["--problem", str(folder / "problem.yaml"), "--design", str(folder / "design.nc")]
    told = failing("fabricate", [*words, "--structure", "cloaked", "--out-dir", str(out)])
    for part in expected:
        assert part in told
    assert not out.exists()
    assert not list(folder.glob("fabrication/.*"))
    picture = folder / "fabrication/cloaked_faults/fault_1.png"
    assert picture.exists() == (
        name
        in {*BROKEN} - {"cut short"} | {"slot cuts through", "round corners", "rounder than units"}
    )
    assert picture.exists() == (picture.name in told)
