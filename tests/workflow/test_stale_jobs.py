from pathlib import Path

import pytest

from pipeline.runtime import UserError
from pipeline.workflow.runs import stale_jobs

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


def used(folder: Path) -> Path:
    """The folder, after a run that used a cluster."""
    (folder / stale_jobs.LOGS).mkdir(parents=True)
    return folder


def test_jobs_of_this_folder_and_of_a_run_are_cancelled(queue: Path) -> None:
    here = used(queue.parent)
    others = f"3|cloak_a|/elsewhere\n4|mine|{here}\n"
    queue.write_text(f"1|cloak_a|{here}\n2|cloak_b|{here}\n{others}")
    found = stale_jobs.remaining(here)
    assert found == ["1", "2"]
    stale_jobs.cancel(here, found)
    assert queue.read_text() == others
    assert stale_jobs.remaining(here) == []


def test_a_cluster_that_does_not_answer_is_told(queue: Path) -> None:
    assert stale_jobs.remaining(queue.parent) == []  # no run used a cluster: none is asked
    with pytest.raises(UserError, match="SLURM does not answer"):
        stale_jobs.remaining(used(queue.parent))  # there is no queue to list
