from pathlib import Path

import pytest
import xarray as xr

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.datasets import provenance
from pipeline.problem.reading import load
from tests.pipeline.samples import sample

METHODS = ("sqp", "mma")


@pytest.mark.parametrize(
    ("missed", "overlaps", "shipped"),
    [
        ((0.0, 0.02), (0, 0), "sqp"),
        ((0.0, 1e-9), (0, 0), "mma"),
        ((0.03, 0.02), (0, 0), "mma"),
        ((0.03, 0.0), (0, 1), "sqp"),
    ],
)
def test_a_feasible_design_is_shipped_before_one_of_a_lower_loss(
    fig2: Path,
    tmp_path: Path,
    missed: tuple[float, float],
    overlaps: tuple[int, int],
    shipped: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """That by SQP has a loss of 1, that by MMA one of 0.5."""
    asked, out = load(fig2), tmp_path / "design.nc"
    paths = [tmp_path / f"{method}.nc" for method in METHODS]
    for number, (method, path) in enumerate(zip(METHODS, paths, strict=True)):
        made = sample("design_method")
        of = {
            "violation": missed[number],
            "overlaps": overlaps[number],
            "best_loss": (1.0, 0.5)[number],
            "best_evaluation": 0,
        }
        made = made.assign({name: xr.full_like(made[name], value) for name, value in of.items()})
        origin = provenance.of_study(asked, "design", method=method)
        datasets.write(made, path, "design_method", origin)
    words = ["--problem", str(fig2), "--out", str(out), "--designs", *map(str, paths)]
    assert run_stage("select", words) == 0
    assert datasets.read(out, "design").attrs["shipped_method"] == shipped
    told = f"misses a constraint by {missed[METHODS.index(shipped)]}"
    assert (told in capfd.readouterr().err) is (0.03 in missed)
