import csv
from pathlib import Path

import numpy as np
import pytest

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.problem.sections import split_value, sweep_cases
from pipeline.runtime import SweepResult
from pipeline.stages import sweep as stage
from reports.__main__ import main
from reports.products.sweep import cases, figure
from tests.pipeline import static
from tests.reports.conftest import Failing

CURVE = "sweep: { grid: { drive.amplitude: { from: 1 mm, to: 3 mm, points: 5 } } }"
MAP = "sweep: { grid: { drive.amplitude: [1 mm, 2 mm, 3 mm], contact.law: [angle, distance] } }"
RANDOM = """sweep:
  random:
    drive.amplitude: { from: 1 mm, to: 3 mm }
    material.bending_stiffness: { mean: 1.5 N mm/rad, deviation: 0.1 N mm/rad }
    material.shear_stiffness: { from: 1.1 N/mm, to: 1.3 N/mm }
  samples: 120
"""
LIMIT = 2.9  # mm, above which the made-up simulation fails
STUCK = "no equilibrium at step 3"


def found(setting: dict[str, str]) -> SweepResult:
    """A loss that grows with the amplitude and with nothing else; half of it with the cloak."""
    amplitude, _ = split_value(setting["drive.amplitude"]) or (np.nan, "")
    if amplitude > LIMIT:
        return SweepResult.failed(STUCK)
    return SweepResult(0.1 * amplitude, 0.2 * amplitude, -0.1 * amplitude)


def paths(folder: Path, text: str) -> tuple[Path, Path]:
    folder.mkdir(parents=True, exist_ok=True)
    at = static.write(folder, static.HOLE + text, size=5)
    asked = problem.load(at)
    assert asked.sweep is not None
    numbered = list(enumerate(sweep_cases.list_settings(asked.sweep)))
    results = {number: found(setting) for number, setting in numbered}  # type: ignore[arg-type]
    made = stage.dataset(asked, numbered, results)
    datasets.write(made, folder / "sweep.nc", "sweep", provenance.of_study(asked, "sweep"))
    return at, folder / "sweep.nc"


def drawn(folder: Path, text: str) -> Path:
    at, data = paths(folder, text)
    out = folder / "sweep"
    words = ["--problem", str(at), "--sweep", str(data), "--out-dir", str(out)]
    assert main(["sweep", *words]) == 0
    return out


@pytest.fixture(scope="module")
def drawn_map(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the map, with its dataset above it."""
    return drawn(tmp_path_factory.mktemp("one") / "study", MAP)


def facts_of(page: Path) -> dict[str, float]:
    with (page / "facts.csv").open() as file:
        return {row["key"]: float(row["value"]) for row in csv.DictReader(file)}


@pytest.mark.parametrize("text", [CURVE, MAP, RANDOM], ids=["curve", "map", "random"])
def test_the_page_shows_what_the_dataset_holds(tmp_path: Path, drawn_map: Path, text: str) -> None:
    page = drawn_map if text == MAP else drawn(tmp_path, text)
    data = datasets.read(page.with_name("sweep.nc"), "sweep")
    html = (page / "index.html").read_text()
    with (page / "cases.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == list(data["status"].values)
    losses = [float(row["loss (1)"] or "nan") for row in rows]
    assert losses == pytest.approx(list(data["loss"].values), nan_ok=True)
    for key in data["parameter"].values:
        assert str(key) in html
    assert '<a href="../sweep.nc">' in html
    assert f"<td>{STUCK}</td>" in html
    known = facts_of(page)
    if text == RANDOM:  # one parameter matters, two do not
        assert known["rank_0"] == pytest.approx(1.0)
        assert all(abs(known[rank]) < 0.3 for rank in ("rank_1", "rank_2"))
    assert known["cases"] == data.sizes["case"]
    assert known["failed"] == sum(data["status"].values == STUCK) > 0
    assert known["median_ratio"] == pytest.approx(50.0)
    assert known["improved"] == pytest.approx(100.0)


def test_the_same_dataset_gives_the_same_bytes(tmp_path: Path, drawn_map: Path) -> None:
    first, second = drawn_map, drawn(tmp_path / "study", MAP)
    names = sorted(path.name for path in first.iterdir())
    assert {"index.html", "cases.csv", "facts.csv", "sweep.pdf", "sweep.svg"} < set(names)
    assert all((first / name).read_bytes() == (second / name).read_bytes() for name in names)


def test_the_figure_of_a_draft_is_marked(tmp_path: Path, drawn_map: Path) -> None:
    """Mark the file too, which goes on without its page."""
    at, data = paths(
        tmp_path, f"{CURVE}\npresets: {{ quick: {{ drive: {{ amplitude: 1 mm }} }} }}\n"
    )
    asked = problem.load(at, "quick")
    held = datasets.read(data, "sweep")
    datasets.write(held.drop_attrs(deep=False), data, "sweep", provenance.of_study(asked, "sweep"))
    words = ["--problem", str(at), "--preset", "quick", "--sweep", str(data)]
    assert main(["sweep", *words, "--out-dir", str(tmp_path / "sweep")]) == 0
    assert "DRAFT" in (tmp_path / "sweep/sweep.svg").read_text()
    assert "DRAFT" not in (drawn_map / "sweep.svg").read_text()


@pytest.mark.parametrize(("samples", "size", "shade"), [(12, 3.5, 0.9), (400, 1.5, 0.5)])
def test_few_points_are_large_and_the_legend_shows_points(
    samples: int, size: float, shade: float, tmp_path: Path
) -> None:
    at, data = paths(tmp_path, RANDOM.replace("120", str(samples)))
    sweep = problem.load(at).sweep
    assert sweep is not None
    made = figure.draw_sweep(datasets.read(data, "sweep"), sweep)
    points = made.axes[0].lines[0]
    assert points.get_markersize() == size
    assert points.get_alpha() == shade
    for handle in made.legends[0].get_lines():
        assert (handle.get_marker(), handle.get_linestyle()) == ("o", "None")


def test_words_take_places_beside_each_other(tmp_path: Path) -> None:
    _, data = paths(tmp_path, MAP)
    amplitude, law = cases.axes(datasets.read(data, "sweep"))
    assert amplitude.label == "drive.amplitude (mm)"
    assert list(amplitude.distinct) == [1.0, 2.0, 3.0]
    assert law.words == ("angle", "distance")
    assert list(law.places) == [0, 0, 0, 1, 1, 1]


def test_bars_and_axes_tell_their_units(tmp_path: Path) -> None:
    at, path = paths(tmp_path, MAP)
    data, asked = datasets.read(path, "sweep"), problem.load(at)
    assert asked.sweep is not None
    for unit, shown in (("N mm", "N mm"), ("1", "")):
        data["loss"].attrs["units"] = unit
        maps = figure.draw_sweep(data, asked.sweep).axes
        assert [bar.get_title(loc="left") for bar in maps[1::2]] == [shown, "", "°"]
        assert maps[0].get_xlabel() == "drive.amplitude (mm)"
        loss, _, angle = figure.measures(data)
        assert loss.label == ("Loss $J$ (N mm)" if shown else "Loss $J$")
        assert angle.label == "Void angle (°)"


def test_a_sweep_of_another_problem_is_refused(tmp_path: Path, failing: Failing) -> None:
    at, data = paths(tmp_path, CURVE)
    at.write_text(at.read_text().replace("1.19 N/mm", "1.2 N/mm"))
    told = failing("sweep", tmp_path / "out", "--problem", at, "--sweep", data)
    assert "made from another problem" in told
