import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from benchmarks.methods import selection
from benchmarks.scenes import TITLES
from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.datasets.tables import Kind
from reports.__main__ import main
from reports.base import style
from reports.products.benchmark import charts, marks, optimisers, tables, work_precision

MACHINE = {"processor": "abacus", "cores": 2, "date": "2026-01-01T00:00:00"}
MACHINE |= {"commit": "0123456789abcdef"}


def points(rows: list[tuple[str, str, str, int, float, float, str]]) -> xr.Dataset:
    """Of (method, setting, task, units, time, error, outcome)."""
    method, setting, task, units, time, error, outcome = map(list, zip(*rows, strict=True))
    times = np.array(time)[:, None] * [1.0, 0.9, 1.2]
    quantities = ["displacement", "loss", "gradient"]
    return xr.Dataset(
        {
            "own": ("point", np.ones(len(rows), dtype=np.int8)),
            "cpu_time": (("point", "run"), times),
            "wall_time": (("point", "run"), 2 * times),
            "compile_time": ("point", np.ones(len(rows))),
            "memory": ("point", 5e8 + 1e5 * np.array(units, dtype=float)),
            "error": (("point", "quantity"), np.array(error)[:, None] * [1.0, 0.1, 0.5]),
            "count": (("point", "work"), np.full((len(rows), 1), 7.0)),
            "outcome": ("point", outcome),
        },
        {
            "quantity": quantities,
            "work": ["steps"],
            "method": ("point", method),
            "setting": ("point", setting),
            "task": ("point", task),
            "units": ("point", units),
        },
    )


def precisions() -> xr.Dataset:
    rows = [
        (method, f"{10.0**-k:g}", task, 25, base * 2.0**k, 10.0**-k, "measured")
        for method, base in (("ESDIRK3, panels", 0.01), ("scipy Radau", 0.4))
        for k in (2, 4, 6)
        for task in ("loss", "gradient")
    ]
    failed = ("scipy BDF", "1e-06", "loss", 25, np.nan, np.nan, "took longer than 90 s")
    return points([*rows, failed])


def grown() -> xr.Dataset:
    name = "Newton, by size"
    sizes = [(n, n * n, 1e-6 * n**3) for n in (15, 30, 60)]
    return points([(name, f"{n} x {n}", "loss", m, t, 1e-12, "measured") for n, m, t in sizes])


def swept() -> xr.Dataset:
    counts = (1, 10, 100)
    rows = [("sweep", f"{n} cases", "loss", 225, 0.1 * n, 1e-12, "measured") for n in counts]
    numbers = ("point", "work"), np.array(counts, dtype=float)[:, None]
    return points(rows).assign_coords(work=["cases"]).assign(count=numbers)


def skipped() -> xr.Dataset:
    times = (("done", 2.0, 1e-3), ("skipped", 0.1, 0.0))
    return points([("inertia", s, "loss", 25, time, e, "measured") for s, time, e in times])


def contest() -> xr.Dataset:
    fall = np.array([[1.0, 0.5, 0.02, 0.01], [1.0, 0.9, 0.2, np.nan]])
    clock = np.where(np.isfinite(fall), np.arange(1.0, 5.0), np.nan)
    dims = ("optimiser", "evaluation")
    return xr.Dataset(
        {
            **dict.fromkeys(("loss", "best_loss", "kkt_residual"), (dims, fall)),
            "violation": (dims, 0 * fall),
            "cpu_time": (dims, clock),
            "final_loss": ("optimiser", np.array([0.01, 0.2])),
            "outcome": ("optimiser", ["measured", "measured"]),
        },
        {"optimiser": ["own sqp", "scipy SLSQP"]},
    )


def tracked() -> xr.Dataset:
    dims = ("video", "tracker", "thinning")
    return xr.Dataset(
        {
            "frame_rate": (dims[::2], np.array([[60.0, 30.0]])),
            "error": ((*dims, "dof"), np.full((1, 2, 2, 3), 0.01) * [1.0, 1.0, 0.1]),
            "lost": (dims, np.zeros((1, 2, 2))),
            "cpu_time": (dims, np.full((1, 2, 2), 0.1)),
        },
        {
            "video": ["dots"],
            "tracker": ["own tracker", "plain OpenCV"],
            "thinning": [1, 2],
            "dof": ["ux", "uy", "theta"],
        },
    )


GIVEN: dict[str, tuple[xr.Dataset, Kind]] = {
    "precision_small": (precisions(), "benchmark"),
    "optimisers_small": (contest(), "contest"),
    "growth": (grown(), "benchmark"),
    "cases": (swept(), "benchmark"),
    "ablation": (skipped(), "benchmark"),
    "tracking": (tracked(), "tracking"),
}


def page_of(out: Path, *names: str) -> str:
    """The page of some of the suites."""
    for name in names:
        data, kind = GIVEN[name]
        about = {"machine": json.dumps(MACHINE), "subject": f"of {name}", "reference": "truth"}
        origin = provenance.of_recording("{}", {}, synthetic=False, role="rules")
        datasets.write(data.assign_attrs(about), out / f"{name}.nc", kind, origin)
    files = [str(out / f"{name}.nc") for name in names]
    assert main(["benchmark", "--datasets", *files, "--out-dir", str(out), "--quiet"]) == 0
    return (out / "index.html").read_text()


@pytest.mark.slow
def test_the_page_shows_every_picture_with_its_table(tmp_path: Path) -> None:
    page = page_of(tmp_path, *GIVEN)
    assert page.count("<svg") == len(GIVEN) + 1  # and the cost of gradients
    for name in GIVEN:
        assert f'href="{name}.nc"' in page
        assert (tmp_path / f"{name}.csv").is_file()
    assert "gradients.pdf" in page
    assert "abacus, 2 cores, 2026-01-01, commit 0123456789" in page
    assert "not the same bytes" in page
    for name in GIVEN:
        with (tmp_path / f"{name}.csv").open(encoding="utf-8", newline="") as file:
            heading, *rows = csv.reader(file)
        assert rows
        assert {len(row) for row in rows} == {len(heading)}


def test_failures_are_listed_with_their_reason(tmp_path: Path) -> None:
    assert "<td>took longer than 90 s</td>" in page_of(tmp_path, "precision_small")
    (failure,) = tables.failures(precisions())
    assert failure == ("scipy BDF", "1e-06", "loss", "took longer than 90 s")


def test_diagrams_show_medians_against_errors() -> None:
    with style.styled():
        first = work_precision.draw_work_precision(precisions()).axes[0]
    drawn = np.concatenate([np.asarray(line.get_xydata()) for line in first.lines[::1]])
    own = np.array([[10.0**-k, 0.01 * 2.0**k] for k in (2, 4, 6)])
    assert all(np.isclose(drawn, point).all(axis=1).any() for point in own)
    assert not np.isnan(drawn).any()


def test_exponents_and_profiles() -> None:
    units = np.array([225, 900, 3600])
    assert charts.exponent(units, 1e-6 * units**1.5, 900) == pytest.approx(1.5)
    assert np.isnan(charts.exponent(units[:2], np.ones(2), 900))
    needed = optimisers.costs({"small": contest()})
    assert needed == {"own sqp": [3.0, 3.0, 3.0], "scipy SLSQP": [3.0, np.inf, np.inf]}


@pytest.mark.parametrize("scene", TITLES)
def test_every_method_of_a_scene_is_drawn_in_its_own_way(scene: str) -> None:
    methods = [method.name for method in selection.methods(scene)]
    assert set(methods) <= marks.MARKS.keys()
    assert len({marks.mark(method) for method in methods}) == len(methods)


@pytest.mark.parametrize("scene", selection.BY_DIFFERENCES)
def test_a_gradient_by_differences_has_a_loss_beside_it(scene: str) -> None:
    methods = {method.name for method in selection.methods(scene)}
    for method, losses in work_precision.PLAIN.items():
        assert method in methods
        assert methods & set(losses)
