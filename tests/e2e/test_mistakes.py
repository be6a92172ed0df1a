"""Mistakes and refusals meet the real stages: one message, an exit code, and nothing lost."""

from pathlib import Path

import numpy as np
import xarray as xr

from tests.e2e.checkout import STUDY, Checkout, assert_one_message

DESIGN = ("--method", "mma", "--out")
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


def test_a_bad_problem(fresh: Checkout) -> None:
    fresh.edit("spacing: 15 mm", "spacng: 15 mm")
    place = f"experiments/{STUDY}/problem.yaml, line"
    for ended in (fresh.make(), fresh.stage("pipeline design", *DESIGN, "x.nc")):
        assert_one_message(ended, place, "lattice.spacng", "value:")
    assert not (fresh.root / "x.nc").exists()
    assert not fresh.results.exists()


def test_a_bad_problem_leaves_results_alone(undisturbed: Checkout) -> None:
    before, text = undisturbed.built(), undisturbed.problem.read_text()
    undisturbed.edit("columns: 5", "columns: five")
    ended = undisturbed.make()
    undisturbed.problem.write_text(text)
    assert_one_message(ended, "lattice.columns")
    assert undisturbed.built() == before


def test_a_truncated_or_foreign_design(undisturbed: Checkout, tmp_path: Path) -> None:
    truncated, foreign = tmp_path / "truncated.nc", tmp_path / "foreign.nc"
    whole = (undisturbed.results / "design.nc").read_bytes()
    truncated.write_bytes(whole[: len(whole) // 2])
    xr.Dataset({"temperature": ("x", np.zeros(3))}).to_netcdf(foreign)
    for path in (truncated, foreign, tmp_path / "missing.nc"):
        out = tmp_path / "response.nc"
        for module, more in (
            ("pipeline simulate", ("--out", str(out))),
            ("reports study", ("--out-dir", str(tmp_path / "report"))),
        ):
            results = undisturbed.results
            others = ("--response", str(results / "response.nc"), "--sweep")
            given = (*others, str(results / "sweep.nc")) if module == "reports study" else ()
            ended = undisturbed.stage(module, "--design", str(path), *given, *more)
            assert_one_message(ended, f"file:   {path}")
        assert not out.exists()


def test_a_folder_that_is_read_only(fresh: Checkout) -> None:
    (fresh.root / "results").mkdir(mode=0o555)
    for ended in (
        fresh.make(first=ORDINARY_RIGHTS),
        fresh.stage("pipeline design", *DESIGN, "results/x/x.nc", first=ORDINARY_RIGHTS),
    ):
        assert_one_message(ended, "results")


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
