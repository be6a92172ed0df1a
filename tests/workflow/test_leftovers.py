"""What a killed run left on a cluster, with stand-ins for the commands of SLURM."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline import leftovers
from pipeline.errors import UserError

SQUEUE = "cat {queue}\n"
SCANCEL = 'for number in "$@"; do sed -i "/^$number|/d" {queue}; done\n'


@pytest.fixture
def queue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file that the stand-ins have for a queue."""
    queue = tmp_path / "queue"
    for name, text in (("squeue", SQUEUE), ("scancel", SCANCEL)):
        command = tmp_path / "bin" / name
        command.parent.mkdir(exist_ok=True)
        command.write_text("#!/bin/sh\n" + text.format(queue=queue))
        command.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:/usr/bin:/bin")
    return queue


def test_jobs_of_this_folder_and_of_a_run_are_cancelled(queue: Path) -> None:
    others = "3|cloak_a|/elsewhere\n4|mine|/here\n"
    queue.write_text(f"1|cloak_a|/here\n2|cloak_b|/here\n{others}")
    assert leftovers.cancel(Path("/here")) == ["1", "2"]
    assert queue.read_text() == others
    assert leftovers.cancel(Path("/here")) == []


def test_a_cluster_that_does_not_answer_is_told(queue: Path) -> None:
    with pytest.raises(UserError, match="SLURM does not answer"):
        leftovers.cancel(queue.parent)  # there is no queue to list


def test_without_a_cluster_there_is_nothing_to_cancel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert leftovers.cancel(tmp_path) == []
