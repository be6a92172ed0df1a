"""No stage reads a file that the provenance of what it makes does not name."""

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import xarray as xr
from PIL import Image

from pipeline.__main__ import run_stage
from pipeline.calibration.inputs import Calibration
from pipeline.datasets import provenance
from pipeline.problem.fields import named_files
from pipeline.problem.reading import load_section
from pipeline.runtime import ROOT
from tests.pipeline.calibration.specimens import STIFFNESS, described, force_sets, written
from tests.pipeline.static import MIMIC, designed, write
from tests.tables import some

VALIDATION = ROOT / "experiments/validation"
DRAWN = (
    "void: { image: { file: void.png, size: [14 mm, 14 mm] } }\n"
    "cloak: { disc: { radius: 22 mm } }\nsweep: { list: { drive.amplitude: [1 mm] } }\n" + MIMIC
)
CHUNK = ["--chunk", "0", "--chunks", "1"]
_watched: list[Path] | None = None


def _watch(event: str, words: tuple[object, ...]) -> None:
    if _watched is None or event != "open" or not isinstance(words[0], str):
        return
    if not set(str(words[1])) & set("wax+"):
        _watched.append(Path(words[0]).resolve())


sys.addaudithook(_watch)  # which stays, and does nothing but below


@pytest.fixture
def read() -> Iterator[Callable[[str, list[str], Path], set[Path]]]:
    """Runs a stage; returns the files of a folder that it read."""
    global _watched  # noqa: PLW0603

    def run(stage: str, words: list[str], folder: Path) -> set[Path]:
        global _watched  # noqa: PLW0603
        _watched = []
        assert run_stage(stage, [*words, "--quiet"]) == 0
        found, _watched = set(_watched), None
        out = Path(words[words.index("--out") + 1])
        inside = {path for path in found if path.is_relative_to(folder.resolve())}
        return {path for path in inside if path.is_file() and path.stem != out.stem}

    yield run
    _watched = None


Read = Callable[[str, list[str], Path], set[Path]]


def recorded(path: Path) -> set[str]:
    with xr.open_dataset(path) as made:
        return set(json.loads(made.attrs["parents"]).values())


def unnamed(files: set[Path], hashes: set[str]) -> set[Path]:
    """Those of files that no hash is of, nor that of their folder."""
    return {
        path
        for path in files
        if not {provenance.file_hash(path), provenance.file_hash(path.parent)} & hashes
    }


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The problem file of a study whose void is an image."""
    folder = tmp_path_factory.mktemp("study")
    Image.new("1", (8, 8), 0).save(folder / "void.png")
    return write(folder, DRAWN, size=5, amplitude=3.0)


@pytest.mark.parametrize(
    ("part", "name"),
    some([("cycles", "morpher"), ("pictures", "pictures"), ("samples", "hinges")], 1),
)
def test_validations(part: str, name: str, read: Read, tmp_path: Path) -> None:
    out, described = tmp_path / "made.nc", VALIDATION / f"{name}.yaml"
    files = read("validate", [part, str(described), "--out", str(out)], VALIDATION)
    assert len(files) > 2
    assert unnamed(files - {described}, recorded(out)) == set()


@pytest.mark.slow
def test_calibrations(study: Path, read: Read, tmp_path: Path) -> None:
    noise = {"displacement": "0.01 mm", "rotation": "0.1 deg"}
    track = {"kind": "track", "name": "filmed", "problem": str(study), "structure": "altered"}
    virtual = {"rate": "10 Hz", "noise": noise, "load": "0.05 N"}
    sets = [*force_sets(points=6), {**track, "virtual": virtual, "load": {"noise": "0.05 N"}}]
    source = written(tmp_path, described(sets, STIFFNESS))
    data, out = tmp_path / "data", tmp_path / "found.nc"
    assert run_stage("calibrate", ["synthesise", str(source), "--out-dir", str(data)]) == 0
    read_for_it = {source, study, study.with_name("void.png")}
    assert unnamed(read_for_it, recorded(data / "filmed.nc")) == set()
    files = read("calibrate", [str(data / "calibration.yaml"), "--out", str(out)], tmp_path.parent)
    assert study.with_name("void.png").resolve() in files
    assert unnamed(files - {data / "calibration.yaml"}, recorded(out)) == set()


def test_computed_sets_name_the_files_of_their_lattices(tmp_path: Path) -> None:
    units = VALIDATION / "hinge_statics/random_quads_8x8.csv"
    (tmp_path / "units.csv").write_bytes(units.read_bytes())
    own = {"kind": "file", "file": "units.csv", "spacing": "15 mm"}
    sets = [{**each, "lattice": own} for each in force_sets(points=6)[:1]]
    source, data = written(tmp_path, described(sets, STIFFNESS)), tmp_path / "made/data"
    assert run_stage("calibrate", ["synthesise", str(source), "--out-dir", str(data)]) == 0
    made = load_section(data / "calibration.yaml", Calibration)
    assert provenance.file_hash(units) in map(
        provenance.file_hash, named_files(made, data).values()
    )


@pytest.mark.parametrize("stage", ["simulate", "as_built", "verify", "sweep run"])
def test_studies(stage: str, study: Path, read: Read, tmp_path: Path) -> None:
    design, out = study.with_name("design.nc"), tmp_path / "made.nc"
    if not design.exists():
        designed(study)
    name, *part = stage.split()
    words = [*part, "--problem", str(study), "--design", str(design), "--out", str(out)]
    files = read(name, [*words, *CHUNK] if part else words, study.parent)
    told = {study, study.with_name("void.png")}  # both are in the dataset's `problem`
    assert unnamed(files - told, recorded(out)) == set()
