"""What counts as the same results, and how a build that fails is told."""

import shutil
import subprocess
from pathlib import Path

import pytest

from pipeline.__main__ import run_stage
from pipeline.workflow import first_look, reproduce
from tests.pipeline.conftest import Failing


def written(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        path = folder / name.replace("__", "/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def test_results_are_compared_and_logs_are_not(tmp_path: Path) -> None:
    first = written(tmp_path / "a", fig2__design="x", fig2__logs__report="monday", index="i")
    second = written(tmp_path / "b", fig2__design="x", fig2__logs__report="friday", index="i")
    assert reproduce.differences(first, second) == (2, [])
    written(second, fig2__design="y", more="z")
    assert reproduce.differences(first, second) == (3, ["fig2/design", "more"])


def build(text: str) -> object:
    """A stand-in for the build of a target: it writes another text each time if `text` is empty."""
    texts = iter(["first", "second"])
    return lambda _target, folder: written(folder / "results", design=text or next(texts))


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def test_two_builds_are_compared(
    place: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    failing: Failing,
) -> None:
    monkeypatch.setattr(reproduce, "SOURCES", ())
    told = failing("reproduce", ["fig2@quick"])
    assert "the build failed" in told
    (kept,) = place.glob("reproduce_*")
    assert str(kept / "first") in told
    shutil.rmtree(kept)
    monkeypatch.setattr(reproduce, "_built", build(""))
    told = failing("reproduce", ["fig2@quick"])
    assert "1 of 1 files differ between two builds: design" in told
    (kept,) = place.glob("reproduce_*")
    assert str(kept) in told
    assert (kept / "second/results/design").read_text() == "second"
    shutil.rmtree(kept)
    monkeypatch.setattr(reproduce, "_built", build("same"))
    assert run_stage("reproduce", ["fig2@quick"]) == 0
    equal = "fig2@quick: two builds have the same bytes (files compared: 1)"
    assert equal in capfd.readouterr().err
    assert not list(place.glob("reproduce_*"))


def test_a_build_elsewhere_leaves_no_picture_in_the_results(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Puts its first look where the workflow runs."""
    folders = []

    def show(_: object, cwd: Path, check: bool) -> subprocess.CompletedProcess[str]:
        folders.append(cwd)
        return subprocess.CompletedProcess([], int(check))

    monkeypatch.setattr(subprocess, "run", show)
    monkeypatch.chdir(place)
    first_look.show(["fig2@quick"])
    assert folders == [place]


@pytest.mark.parametrize("stage", ["reproduce", "publish"])
def test_an_installed_package_has_no_sources_to_build_from(
    monkeypatch: pytest.MonkeyPatch, failing: Failing, stage: str
) -> None:
    monkeypatch.setattr(f"pipeline.workflow.{stage}.INSTALLED", True)
    told = failing(stage, ["fig2@quick"])
    assert "of a checkout, which an installed package lacks" in told
    assert f"make {stage} STUDY=" in told
