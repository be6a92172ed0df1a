"""Mistakes and refusals meet the real stages: one message, an exit code, and nothing lost."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline.__main__ import run_stage
from reports.__main__ import main
from tests.e2e.checkout import STUDY, Checkout, Ended, assert_one_message

# Root may write where modes forbid it, by its capability CAP_DAC_OVERRIDE (1): this drops it.
ORDINARY_RIGHTS = """
import ctypes, os
if os.geteuid() == 0:
    PR_CAPBSET_DROP = 24
    assert ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, 1) == 0
"""
LITTLE_ROOM = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (16 << 10, 16 << 10))
"""


def test_a_bad_problem_leaves_results_alone(fresh: Checkout, undisturbed: Checkout) -> None:
    shutil.copytree(undisturbed.results, fresh.results)
    before = fresh.built()
    assert before
    fresh.edit("columns: 5", "columns: five")
    place = f"experiments/{STUDY}/problem.yaml, line"
    assert_one_message(fresh.make(), place, "lattice.columns", "value:")
    assert fresh.built() == before


def test_a_truncated_or_foreign_design(
    undisturbed: Checkout, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truncated, foreign = tmp_path / "truncated.nc", tmp_path / "foreign.nc"
    whole = (undisturbed.results / "design.nc").read_bytes()
    truncated.write_bytes(whole[: len(whole) // 2])
    xr.Dataset({"temperature": ("x", np.zeros(3))}).to_netcdf(foreign)
    built, out = undisturbed.results, tmp_path / "response.nc"
    others = ("--response", str(built / "response.nc"), "--sweep", str(built / "sweep.nc"))
    for path in (truncated, foreign, tmp_path / "missing.nc"):
        given = ("--problem", str(undisturbed.problem), "--design", str(path))
        for run, words in (
            (run_stage, ("simulate", [*given, "--out", str(out)])),
            (main, (["study", *given, *others, "--out-dir", str(tmp_path / "report")],)),
        ):
            code = run(*words)
            assert_one_message(Ended("", code, *capsys.readouterr()), f"file:   {path}")
        assert not out.exists()


def test_a_folder_that_is_read_only(fresh: Checkout) -> None:
    (fresh.root / "results").mkdir(mode=0o555)
    assert_one_message(fresh.make(first=ORDINARY_RIGHTS), "results")


def test_a_disk_with_too_little_room(undisturbed: Checkout, tmp_path: Path) -> None:
    design = str(undisturbed.results / "design.nc")
    out = tmp_path / "response.nc"
    out.write_bytes(b"what was there")
    ended = undisturbed.stage(
        *("pipeline simulate", "--design", design, "--out", str(out)), first=LITTLE_ROOM
    )
    assert_one_message(ended, "the file would be too large", str(tmp_path))
    assert out.read_bytes() == b"what was there"
    assert list(tmp_path.iterdir()) == [out]
