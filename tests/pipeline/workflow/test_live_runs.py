"""Left-over jobs end, and no job of a run that lives: however and wherever that was started."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pipeline.runtime import RUN_MARK, UserError
from pipeline.workflow import run
from pipeline.workflow.runs import Run, stale_jobs, study_lock

Begin = Callable[..., subprocess.Popen[bytes]]
IDLE = "import time; time.sleep(60)"
HOLDING = (
    "import sys; from pipeline.workflow.runs import study_lock; study_lock.hold(['results/fig2/a'])"
)


@pytest.fixture
def begin() -> Iterator[Begin]:
    """Starts processes that idle, with words on their command lines, until the test is over."""
    begun = []

    def idle(*words: str, mark: str = "") -> subprocess.Popen[bytes]:
        environment = os.environ | {RUN_MARK: mark}
        begun.append(subprocess.Popen([sys.executable, "-c", IDLE, *words], env=environment))
        return begun[-1]

    yield idle
    for process in begun:
        process.kill()
        process.wait()


def test_a_run_needs_no_script_of_its_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Begins with the folder that the environment was made in."""
    begun: list[list[str]] = []
    for name in ("check_problems", "_clear_the_ground", "_end_with_make"):
        monkeypatch.setattr(run, name, lambda *_: None)
    monkeypatch.setattr("pipeline.runtime.streams.complete", lambda: None)
    monkeypatch.setattr(os, "execv", lambda _, words: begun.append(words))
    run.work(["fig2"])
    assert begun == [[sys.executable, "-m", "snakemake", "fig2"]]


def test_jobs_end_whose_run_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begin: Begin
) -> None:
    monkeypatch.setattr(run, "WORK", tmp_path)
    here = Run.own()
    lives = begin("-m", "snakemake", "fig2")
    other = begin("vim")  # has got the number of a run that was killed
    runs = [
        (here._replace(process=lives.pid), False),
        (here._replace(process=other.pid), True),
        (Run(other.pid, "elsewhere"), False),
    ]
    jobs = [begin(mark=f"{tmp_path}:{each}") for each, _ in runs]
    run._clear_the_ground()
    for job, (_, left_over) in zip(jobs, runs, strict=True):
        assert (job.poll() is not None) is left_over


def test_no_job_on_a_cluster_is_cancelled_while_a_study_is_locked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel tells, or a network's file system: not the processes of this host."""
    monkeypatch.setattr(run, "WORK", tmp_path)
    monkeypatch.setattr(stale_jobs, "remaining", lambda _: ["1"])
    cancelled: list[str] = []
    monkeypatch.setattr(stale_jobs, "cancel", lambda _, numbers: cancelled.extend(numbers))
    command = [sys.executable, "-c", f"{HOLDING}; print(flush=True); sys.stdin.read()"]
    pipe = subprocess.PIPE
    holder = subprocess.Popen(
        command,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(Path.cwd())},
        stdin=pipe,
        stdout=pipe,
    )
    assert holder.stdout
    holder.stdout.readline()
    with pytest.raises(UserError, match=f"at work on fig2 .process {holder.pid} on "):
        run._clear_the_ground()
    assert not cancelled
    holder.communicate()
    assert not (tmp_path / study_lock.FOLDER / "fig2").read_text()
    run._clear_the_ground()
    assert cancelled == ["1"]


@pytest.mark.parametrize(
    ("name", "refused"), [("7 on elsewhere", True), (str(Run(1, "")), False), ("damaged", False)]
)
def test_a_run_that_was_killed_on_another_host_is_not_taken_for_ended(
    tmp_path: Path, name: str, refused: bool
) -> None:
    path = tmp_path / study_lock.FOLDER / "fig2"
    path.parent.mkdir(parents=True)
    path.write_text(name)
    if not refused:
        return study_lock.check_free(tmp_path)
    with pytest.raises(UserError, match="may be at work on fig2") as e:
        study_lock.check_free(tmp_path)
    assert e.value.file == str(path)
    return None
