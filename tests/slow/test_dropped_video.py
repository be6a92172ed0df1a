import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from pipeline import datasets, problem
from pipeline.__main__ import run_stage
from pipeline.posing import network_variables, scene_of
from pipeline.problem.reading import overlay_keys
from pipeline.runtime import ROOT
from pipeline.tracking.frames import import_video
from tests.e2e.checkout import Checkout

CLIP = ROOT / "tests/data/tracking/b_harmonic.yaml"
STUDY = "filmed"
AS_FILMED = yaml.safe_load("""
lattice: { ligament_length: 2.3 mm, bias_angle: -20 deg }
drive: { directions: [45 deg], weights: [1.0] }
horizon: { periods: 0.5, samples: 10 }
cloak: { disc: { radius: 16 mm } }
optimiser: { methods: { sqp: { evaluations: 1 }, mma: null } }
solver: { accuracy: draft }
response: { cycles: 0.5, samples: 26 }
prediction: { samples: 4 }
report: { measured_constants: null, as_built: false }
""")


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A checkout with a study of the specimen that the clip shows, designed and simulated."""
    made = Checkout.made(tmp_path_factory.mktemp("filmed") / "checkout")
    folder, results = made.root / "experiments" / STUDY, made.root / "results" / STUDY
    recordings = folder / "recordings"
    recordings.mkdir(parents=True)
    results.mkdir(parents=True)
    whole = yaml.safe_load((ROOT / "experiments/fig2/problem.yaml").read_text())
    del whole["presets"]
    text = yaml.safe_dump(overlay_keys(whole, AS_FILMED), sort_keys=False)
    (folder / "problem.yaml").write_text(text)
    _built(folder / "problem.yaml", results)
    (recordings / "altered.yaml").write_text("structure: altered\nvirtual: {}\n")
    return made


def _built(path: Path, results: Path) -> None:
    """Design and response of the study, whose cloak has kept the shape that was filmed."""
    asked = problem.load(path)
    shape = import_video.design(import_video.description(CLIP))
    design = shape.assign(network_variables(asked, scene_of(asked, path.parent)))
    origin = {"problem": "{}", "problem_hash": "", "parents": "{}"}
    made = str(results / "design.nc")
    datasets.write(design, made, "design", origin)
    words = ["--problem", str(path), "--design", made, "--out", str(results / "response.nc")]
    assert run_stage("simulate", [*words, "--quiet"]) == 0


@pytest.fixture(scope="module")
def dropped(checkout: Checkout) -> Checkout:
    """The same after a video was dropped in, with its YAML and the design that it shows."""
    folder = checkout.root / "experiments" / STUDY / "recordings"
    video = shutil.copy(CLIP.with_suffix(".mp4"), folder / "lab.mp4")
    words = ["import", str(CLIP), "--video", str(video), "--out-dir", str(folder), "--quiet"]
    assert run_stage("track", words) == 0
    with (folder / "lab_recording.yaml").open("a", encoding="utf-8") as file:
        file.write("structure: altered\n")
    return checkout


@pytest.fixture(scope="module")
def compared(dropped: Checkout) -> xr.Dataset:
    """Its comparison, as the workflow makes it."""
    target = f"results/{STUDY}/recordings/lab_recording/comparison.nc"
    ended = dropped.snakemake(target)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return datasets.read(dropped.root / target, "comparison")


def test_it_takes_the_place_of_the_virtual_one(dropped: Checkout) -> None:
    assert len(list((dropped.root / "experiments" / STUDY / "recordings").glob("*.yaml"))) == 2
    ended = dropped.shell(f".venv/bin/snakemake --dry-run {STUDY}")
    planned = ended.stdout + ended.stderr
    assert "Comparing lab_recording" in planned
    assert "altered of filmed" not in planned


def test_it_is_compared_with_the_simulation(compared: xr.Dataset) -> None:
    assert compared.attrs["structure"] == "altered"
    assert compared.attrs["synthetic"] == "yes"
    assert int((compared["use"] == 0).sum()) == 225 - 4 - 1
    assert float(compared["drive_correlation"]) > 0.9
    assert compared["simulated"].notnull().all()
    assert int(compared["band_samples"]) == 4
    truth = np.load(CLIP.with_name("b_harmonic_truth.npz"))["displacement"]
    off = np.sqrt(np.mean((compared["measured"].values - truth) ** 2, axis=(0, 1)))
    assert (off < [0.01, 0.01, 0.003]).all()
