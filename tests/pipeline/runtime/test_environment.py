"""Caches have a folder that can be written, and that nobody else can."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.runtime import ROOT
from sim.core import TEMPORARY_NAME

TOLD = """
import os, pipeline
names = ("XDG_CACHE_HOME", "JAX_COMPILATION_CACHE_DIR", "LOGNAME", "HOME")
print(*(os.environ.get(name, "none") for name in names), sep="\\n")
"""


NOBODY = """
import pwd

def getpwuid(number: int) -> None:
    raise KeyError(f"getpwuid(): uid not found: {number}")

pwd.getpwuid = getpwuid
"""


def caches(home: Path, spare: Path, **named: str) -> list[str]:
    """Tells where a process with this home keeps caches: the user's, and that of JAX."""
    return told(spare, HOME=str(home), **named)[:2]


def told(spare: Path, **named: str) -> list[str]:
    """Tells the same of any process, and the name and home of its user."""
    kept = {"PYTHONPATH": str(ROOT), "TMPDIR": str(spare)}
    words = subprocess.check_output(
        [sys.executable, "-c", TOLD], env=kept | named, cwd=ROOT, text=True
    )
    return words.split()


@pytest.fixture
def spare(tmp_path: Path) -> Path:
    """Makes a folder for temporary files."""
    (tmp_path / "spare").mkdir()
    return tmp_path / "spare"


def test_a_home_that_can_be_written_has_the_caches(tmp_path: Path, spare: Path) -> None:
    jax = f"{tmp_path}/.cache/metacloak/jax"
    assert caches(tmp_path, spare) == ["none", jax]
    other = f"/of/another/machine/{TEMPORARY_NAME}"
    named = {"XDG_CACHE_HOME": other, "JAX_COMPILATION_CACHE_DIR": f"{other}/metacloak/jax"}
    assert caches(tmp_path, spare, **named) == ["none", jax]
    named = {"XDG_CACHE_HOME": f"{tmp_path}/own", "JAX_COMPILATION_CACHE_DIR": "/asked/for"}
    assert caches(tmp_path, spare, **named) == list(named.values())


def test_another_home_is_given_to_them_where_it_cannot(spare: Path) -> None:
    own = spare / TEMPORARY_NAME
    assert caches(Path("/proc"), spare) == [f"{own}", f"{own}/metacloak/jax"]
    assert own.stat().st_mode & 0o777 == 0o700


def test_what_others_may_have_written_is_no_home_of_caches(spare: Path) -> None:
    (spare / TEMPORARY_NAME).mkdir()
    (spare / TEMPORARY_NAME).chmod(0o777)
    named = {"XDG_CACHE_HOME": f"{spare / TEMPORARY_NAME}"}
    assert os.fspath(spare) not in " ".join(caches(Path("/proc"), spare, **named))


def test_a_user_that_the_machine_does_not_know_has_a_name_and_a_home(
    tmp_path: Path, spare: Path
) -> None:
    """As one of a container that is given a number."""
    (tmp_path / "sitecustomize.py").write_text(NOBODY)
    own, path = spare / TEMPORARY_NAME, f"{tmp_path}:{ROOT}"
    expected = ["none", f"{own}/.cache/metacloak/jax", str(os.getuid()), f"{own}"]
    assert told(spare, PYTHONPATH=path) == expected
    assert told(spare, PYTHONPATH=path, HOME=f"/elsewhere/{TEMPORARY_NAME}") == expected
    assert told(spare, PYTHONPATH=path, LOGNAME="ada", HOME="/")[2:] == ["ada", "/"]
