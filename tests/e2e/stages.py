"""The stages of a study by their own command lines, within this process."""

from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.problem.reading import load


@dataclass(frozen=True)
class Built:
    """What the stages made of a study."""

    design: xr.Dataset
    response: xr.Dataset

    @property
    def best_loss(self) -> float:
        """Loss of the shipped design."""
        shipped = self.design.attrs["shipped_method"]
        return float(self.design["best_loss"].sel({"method": shipped}))


def build(problem: Path, preset: str | None, folder: Path) -> Built:
    """Designs by every method that the problem asks for, ships the better, simulates it.

    Where a preset starts from the study's design, that is built first.
    """
    study, ways, wanted = _options(problem, preset), [], load(problem, preset).optimiser
    start = []
    if wanted.start == "study":
        (folder / "study").mkdir()
        build(problem, None, folder / "study")
        start = ["--start", str(folder / "study/design.nc")]
    for method in wanted.methods.chosen:
        ways.append(str(folder / f"design_{method}.nc"))
        assert run_stage("design", [*study, *start, "--method", method, "--out", ways[-1]]) == 0
    shipped, response = folder / "design.nc", folder / "response.nc"
    assert run_stage("select", [*study, "--designs", *ways, "--out", str(shipped)]) == 0
    assert run_stage("simulate", [*study, "--design", str(shipped), "--out", str(response)]) == 0
    return Built(datasets.read(shipped, "design"), datasets.read(response, "response"))


def build_verification(problem: Path, preset: str | None, folder: Path) -> xr.Dataset:
    """The checks of a design that was built in the folder."""
    out = folder / "verification.nc"
    given = ["--design", str(folder / "design.nc"), "--out", str(out)]
    assert run_stage("verify", [*_options(problem, preset), *given]) == 0
    return datasets.read(out, "verification")


def _options(problem: Path, preset: str | None) -> list[str]:
    study = ["--problem", str(problem), "--quiet"]
    return study if preset is None else [*study, "--preset", preset]
