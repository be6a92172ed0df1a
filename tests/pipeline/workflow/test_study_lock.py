"""Locks of studies where the machine gives none."""

import errno
from pathlib import Path

import pytest

from pipeline.runtime import UserError
from pipeline.workflow.runs import study_lock


def hold(monkeypatch: pytest.MonkeyPatch, folder: Path, number: int) -> None:
    def refuse(*_: object) -> None:
        raise OSError(number, "refused")

    monkeypatch.chdir(folder)
    monkeypatch.setattr("fcntl.flock", refuse)
    study_lock.hold(["results/fig2/design.nc", "results/fig4/design.nc"])


def test_a_file_system_without_locks_is_warned_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    hold(monkeypatch, tmp_path, errno.ENOLCK)
    assert caplog.text.count("begin one run of a study at a time") == 1


def test_another_refusal_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UserError, match="no permission") as told:
        hold(monkeypatch, tmp_path, errno.EACCES)
    assert told.value.file == str(study_lock.FOLDER / "fig2")
