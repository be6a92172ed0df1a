import json
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.posing import design_scene, load_family, scene_of, under_worst
from pipeline.problem.reading import load, overlay_keys
from pipeline.stages import robust_gains
from reports.__main__ import main
from sim.load_family import LoadLosses
from sim.scene import Scene, concrete_parameters, simulate
from sim.solvers import Harmonic
from tests.pipeline.conftest import Failing
from tests.pipeline.samples import sample
from tests.pipeline.static import HOLE, designed, write
from tests.tables import refused

SMALLER = yaml.safe_load("""
lattice: { columns: 5, rows: 5 }
cloak: { disc: { radius: 22 mm } }
drive: { amplitude: 3 mm }
optimiser: { methods: { sqp: { evaluations: 2 } } }
""")
ROBUST = """  region: surroundings
  robust:
    loads: [{ frequency: 8 Hz }, { amplitude: 3 mm, weight: 0.5 }]
    sharpness: 8
    copies: 2
    geometry: 0.02
    stiffness: 0.1
    copy_sharpness: 4
"""


@pytest.fixture
def robust(fig2: Path, tmp_path: Path) -> Path:
    path = tmp_path / "problem.yaml"
    path.write_text(fig2.read_text().replace("  region: surroundings\n", ROBUST, 1))
    return path


def test_the_drives_own_cases_come_first(robust: Path) -> None:
    scene = design_scene(load(robust), robust.parent)
    drives = [motion for motion in scene.loads.motions if isinstance(motion, Harmonic)]
    assert [each.frequency for each in drives] == [2.0] * 4 + [8.0] * 4 + [2.0] * 4
    assert [each.amplitude for each in drives] == [4.5] * 8 + [3.0] * 4
    np.testing.assert_allclose(scene.loads.case_weights, np.repeat([0.1, 0.1, 0.05], 4))
    assert scene.loads.drive_frequency == 8.0
    assert scene.design.copies is not None
    assert scene.design.copies.shifts.shape == (2, scene.lattice.n_groups, 2)
    assert 0.29 < np.abs(scene.design.copies.shifts).max() <= 0.3
    assert 0.09 < scene.design.copies.stiffness.std() < 0.11
    assert scene.objective.copy_sharpness == 4.0


@pytest.mark.slow
def test_a_robust_design_tells_losses_of_the_drives_own_cases(robust: Path, tmp_path: Path) -> None:
    out = tmp_path / "design_sqp.nc"
    content = yaml.safe_load(robust.read_text())
    overlay = overlay_keys(content.pop("presets")["quick"], SMALLER)
    robust.write_text(yaml.safe_dump(overlay_keys(content, overlay)))
    words = ["--problem", str(robust), "--method", "sqp", "--quiet"]
    assert run_stage("design", [*words, "--out", str(out)]) == 0
    made = datasets.read(out, "design_method")
    assert made.sizes["case"] == 4
    assert float(made["best_loss"]) < float(made["loss"][0])
    assert (made["loss"] > 0).all()


def test_a_drive_without_a_frequency_has_no_other_loads(robust: Path) -> None:
    text = robust.read_text().replace("kind: harmonic", "kind: linear_ramp\n  duration: 1 s")
    text = text.replace("  frequency: 2 Hz\n", "").replace("  periods: 2\n", "  duration: 1 s\n", 1)
    before, _, rest = text.partition("\nsweep:\n")
    robust.write_text(before + rest[rest.index("\nreport:") :].partition("\npresets:")[0])
    with refused("no frequency and displacement to vary", "objective.robust.loads"):
        load(robust)


def test_gains_are_over_the_own_design(hole: list[str], tmp_path: Path, failing: Failing) -> None:
    presets = "presets: { tolerant: { objective: { robust: { copies: 2 } } } }\n"
    path = write(tmp_path, HOLE + presets, size=5, amplitude=3.0)
    shipped, out = Path(hole[1]).with_name("design.nc"), tmp_path / "gains.nc"
    words = ["--problem", str(path), "--quiet", "--out", str(out), "--designs"]
    assert run_stage("robust_gains", [*words, f"plain={shipped}", f"tolerant={shipped}"]) == 0
    made = datasets.read(out, "gains").squeeze()
    counts = [made[name].item() for name in ("preset", "loads", "copies")]
    assert counts == ["tolerant", 1, 16]
    assert made["loss_plain"] == made["loss_own"] < made["loss_altered"]
    best = float(datasets.read(shipped, "design")["best_loss"].min())
    assert float(made["price"]) == float(made["loss_drive"]) == pytest.approx(best, rel=1e-4)
    assert made["price"].attrs["units"] == "1"
    page = tmp_path / "page"
    assert main(["robust-gains", *words[:3], "--gains", str(out), "--out-dir", str(page)]) == 0
    text = (page / "index.html").read_text(encoding="utf-8")
    assert "<td>tolerant</td>" in text
    assert "<td>0.0%</td>" in text
    assert "one of a preset" in failing("robust_gains", [*words, f"plain={shipped}"])


def test_gains_of_a_robust_study_are_over_copies_that_it_does_not_know(
    hole: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = []

    def counting(scene: Scene, *_: object) -> float:
        counted.append(0 if scene.design.copies is None else len(scene.design.copies))
        return 1.0

    monkeypatch.setattr(robust_gains, "_mean_loss", counting)
    more = "presets: { worst: { objective: { robust: { copy_sharpness: 8 } } } }\n"
    held = HOLE.replace("target: intact", "target: intact, robust: { copies: 2 }")
    path = write(tmp_path, held + more, size=5, amplitude=3.0)
    shipped = Path(hole[1]).with_name("design.nc")
    robust_gains.gains(path, {"plain": shipped, "worst": shipped})
    assert counted == [16] * 5


def test_a_pulse_is_a_load_of_its_own(fig2: Path) -> None:
    own, pulse = load(fig2), load(fig2, "pulse")
    assert pulse.asks_more_than(own)
    assert not load(fig2, "edge3").asks_more_than(own)
    scene = design_scene(pulse, fig2.parent)
    times = np.linspace(0.0, 0.4, 401)
    largest = max(np.abs(drive.motion(times)).max() for drive in scene.loads.cases)
    assert largest == pytest.approx(4.5)


def certificate(**load: float) -> xr.Dataset:
    """Makes a certificate that has tried but one load."""
    made = sample("certificate")
    for part, value in load.items():
        for kind in ("load", "found"):
            made[f"{kind}_{part}"] = xr.full_like(made[f"{kind}_{part}"], value)
    return made


def test_a_response_is_to_the_load_that_was_certified(fig2: Path) -> None:
    file = fig2.parents[1] / "fig7/problem.yaml"
    asked = load(file, "unbiased")
    family = load_family(asked, file.parent)
    assert family is not None
    certified = family.setups[1].fastest(1)
    assert isinstance(certified, Harmonic)
    worst = certificate(direction=0.0, amplitude=4.5, frequency=15.0, setup=1)
    posed = scene_of(under_worst(asked, worst), file.parent)
    assert posed.loads.motions == (certified._replace(direction=0.0),)


SETUPS = """
void: { disc: { radius: 7 mm } }
cloak: { disc: { radius: 22 mm } }
objective:
  kind: displacement
  target: rest
  loads:
    directions: [90 deg, 270 deg]
    setups:
      - supports: [{ units: bottom }]
        drive: { kind: linear_ramp, units: top, amplitude: 3 mm, duration: 1 s, direction: 270 deg }
        directions: [180 deg, 360 deg]
"""


def test_what_another_setup_drives_is_not_to_rest(tmp_path: Path) -> None:
    """Certifies a load of it by the loss that the response to it has."""
    asked = load(write(tmp_path, SETUPS, size=5, amplitude=3.0))
    family, scene = load_family(asked, tmp_path), scene_of(asked, tmp_path)
    assert family is not None
    posed = family.setups[1].posed(scene)
    assert not np.isin(posed.loads.driven, posed.objective.region).any()
    place, values = np.array([0.5, 0.0, 0.75]), concrete_parameters(scene, scene.lattice.vertices)
    certified = LoadLosses(scene, family, lambda _: values).value(np.zeros(0), place)
    assert family.numbers(place) == pytest.approx([1.5 * np.pi, 3.0])
    worst = certificate(direction=270.0, amplitude=3.0, setup=1)
    response = scene_of(under_worst(asked, worst), tmp_path)
    loss = float(simulate(response, vertices=response.lattice.vertices).loss)
    assert certified == pytest.approx(loss, rel=1e-9)


OFF_CENTRE = {"disc": {"centre": ["30 mm", "58 mm"], "radius": "8 mm"}}


def _starting(fig2: Path, folder: Path, own: dict[str, object], again: dict[str, object]) -> Path:
    """Writes the study's draft with keys laid over it, and a preset that starts from its design."""
    content = yaml.safe_load(fig2.read_text())
    presets = content["presets"]
    presets["quick"] = overlay_keys(overlay_keys(presets["quick"], SMALLER), own)
    started = overlay_keys({"optimiser": {"start": "study"}}, again)
    presets["again"] = overlay_keys(deepcopy(presets["quick"]), started)
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.fixture(scope="module")
def chosen(fig2: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The design of the study's draft, with that of the method beside it."""
    return designed(_starting(fig2, tmp_path_factory.mktemp("study"), {}, {}), "--preset", "quick")


@pytest.mark.parametrize(
    ("own", "again"),
    [
        ({}, {}),
        pytest.param(
            {"void": OFF_CENTRE, "optimiser": {"symmetry": "none"}}, {}, marks=pytest.mark.slow
        ),
        pytest.param({}, {"optimiser": {"symmetry": "none"}}, marks=pytest.mark.slow),
        ({}, {"optimiser": {"start": "previous"}}),
    ],
    ids=["same", "void", "other symmetry", "first of several"],
)
def test_starts_from_the_study(
    fig2: Path, tmp_path: Path, chosen: Path, own: dict[str, object], again: dict[str, object]
) -> None:
    path, out = _starting(fig2, tmp_path, own, again), tmp_path / "again.nc"
    words = ["--problem", str(path), "--method", "sqp", "--quiet", "--preset", "again"]
    start = designed(path, "--preset", "quick") if own else chosen
    assert run_stage("design", [*words, "--start", str(start), "--out", str(out)]) == 0
    first = start.with_name("design_sqp.nc")
    before, after = (datasets.read(name, "design_method") for name in (first, out))
    assert float(after["loss"][0]) == pytest.approx(float(before["best_loss"]), rel=1e-6)
    assert json.loads(after.attrs["parents"])["start"]


def test_a_start_of_other_units(fig2: Path, tmp_path: Path, chosen: Path, failing: Failing) -> None:
    path = _starting(fig2, tmp_path, {}, {"lattice": {"columns": 7, "rows": 7}})
    out = tmp_path / "again.nc"
    words = ["--problem", str(path), "--preset", "again", "--method", "sqp", "--out", str(out)]
    assert "another lattice or void" in failing("design", [*words, "--start", str(chosen)])


@pytest.mark.parametrize("given", [True, False])
def test_a_start_if_asked_for(fig2: Path, tmp_path: Path, failing: Failing, given: bool) -> None:
    words = ["--problem", str(fig2), "--method", "sqp", "--out", str(tmp_path / "x.nc")]
    more = ["--start", str(tmp_path / "design.nc")] if given else ["--preset", "worst"]
    assert "optimiser.start" in failing("design", [*words, *more])
    own = tmp_path / "problem.yaml"
    own.write_text(fig2.read_text().replace("  seed: 0\n", "  seed: 0\n  start: study\n", 1))
    with refused("cannot start from its own design"):
        load(own)
