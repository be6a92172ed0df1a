"""What counts as the same results, and how a build that fails is told."""

from pathlib import Path

import pytest

from pipeline.__main__ import run_stage
from pipeline.workflow import reproduce
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


def test_two_builds_are_compared(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], failing: Failing
) -> None:
    monkeypatch.setattr(reproduce, "SOURCES", ())
    assert "the build failed" in failing("reproduce", ["fig2@quick"])
    monkeypatch.setattr(reproduce, "_built", build(""))
    told = failing("reproduce", ["fig2@quick"])
    assert "1 of 1 files differ between two builds: design" in told
    monkeypatch.setattr(reproduce, "_built", build("same"))
    assert run_stage("reproduce", ["fig2@quick"]) == 0
    equal = "fig2@quick: two builds have the same bytes (files compared: 1)"
    assert equal in capfd.readouterr().err
