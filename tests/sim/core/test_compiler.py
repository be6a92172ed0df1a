"""Compile what is in C once on a machine, and anew after any edit of it."""

import ctypes
import errno
import logging
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from pipeline.runtime import ROOT
from sim.core import TEMPORARY_NAME, compiler

DOUBLE = '#include "loops/times.h"\n\nlong doubled(long n) { return TIMES * n; }\n'
TIMES = "#define TIMES 2\n"
ASK = """
import logging, sys
from pathlib import Path
from sim.core import compiler
logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(message)s")
print(compiler.load(Path(sys.argv[1])).doubled(7))
"""


def loops(folder: Path) -> Path:
    """Writes a folder of C."""
    made = folder / "loops"
    made.mkdir(parents=True)
    (made / "double.c").write_text(DOUBLE)
    (made / "times.h").write_text(TIMES)
    return made


def ask(folder: Path, cache: Path, **places: str) -> subprocess.Popen[str]:
    """Starts a process that prints what the loop makes of 7."""
    named = {"PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(cache)} | places
    return subprocess.Popen(
        [sys.executable, "-c", ASK, str(folder)], env=os.environ | named, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def told(folder: Path, cache: Path, **places: str) -> tuple[str, bool]:
    """Returns that, and whether it was compiled for it."""
    asking = ask(folder, cache, **places)
    out, words = asking.communicate(timeout=120)
    assert asking.returncode == 0, words
    return out.strip(), "compiling loops" in words


def test_another_checkout_compiles_nothing_and_an_edited_file_does(tmp_path: Path) -> None:
    cache, first, second = tmp_path / "cache", loops(tmp_path / "one"), loops(tmp_path / "other")
    assert told(first, cache) == ("14", True)
    assert told(first, cache) == ("14", False)
    assert told(second, cache) == ("14", False)
    (second / "times.h").write_text("#define TIMES 3\n")
    assert told(second, cache) == ("21", True)
    assert told(first, cache) == ("14", False)


def test_processes_that_want_it_at_once_compile_it_once(tmp_path: Path) -> None:
    folder = loops(tmp_path)
    asking = [ask(folder, tmp_path / "cache") for _ in range(3)]
    words = [each.communicate(timeout=120) for each in asking]
    assert [out.strip() for out, _ in words] == ["14"] * 3
    assert sum("compiling loops" in err for _, err in words) == 1


def test_a_folder_that_cannot_be_written_is_replaced_by_one_for_temporary_files(
    tmp_path: Path,
) -> None:
    folder, spare = loops(tmp_path), tmp_path / "spare"
    spare.mkdir()
    nowhere = folder / "double.c" / "none"
    assert told(folder, nowhere, TMPDIR=str(spare)) == ("14", True)
    assert told(folder, nowhere, TMPDIR=str(spare)) == ("14", False)


def test_code_that_others_may_have_written_is_not_run(tmp_path: Path) -> None:
    folder, own = loops(tmp_path), tmp_path / "spare" / TEMPORARY_NAME
    own.mkdir(parents=True)
    own.chmod(0o777)
    asking = ask(folder, folder / "double.c" / "none", TMPDIR=str(own.parent))
    _, words = asking.communicate(timeout=120)
    assert asking.returncode == 1
    assert "what is compiled can be kept nowhere" in words
    assert not list(own.rglob("*.so"))


@pytest.mark.parametrize("share", [0.01, 0.5])
def test_a_damaged_file_is_compiled_again(tmp_path: Path, share: float) -> None:
    folder, cache = loops(tmp_path), tmp_path / "cache"
    told(folder, cache)
    (library,) = cache.rglob("*.so")
    whole = library.read_bytes()
    library.write_bytes(whole[: int(share * len(whole))])
    assert told(folder, cache) == ("14", True)
    assert told(folder, cache) == ("14", False)


def folder_beside(library: Path) -> Path:
    """Makes a folder as of a process that compiles the library, in place of the library."""
    left = library.with_name(f"{library.stem}_left")
    left.mkdir()
    library.unlink()
    return left


def test_what_a_killed_process_leaves_is_removed(tmp_path: Path) -> None:
    folder, cache = loops(tmp_path), tmp_path / "cache"
    told(folder, cache)
    left = folder_beside(*cache.rglob("*.so"))
    assert told(folder, cache) == ("14", True)
    assert not left.exists()


def test_what_another_process_compiles_is_left_where_no_lock_tells_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSYS, "no locks")

    folder, cache = loops(tmp_path), tmp_path / "cache"
    told(folder, cache)
    at_work = folder_beside(*cache.rglob("*.so"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    monkeypatch.setattr("fcntl.flock", refuse)
    assert compiler.load(folder).doubled(7) == 14
    assert at_work.exists()


def test_another_compiler_compiles_anew(tmp_path: Path) -> None:
    folder, cache = loops(tmp_path), tmp_path / "cache"
    assert told(folder, cache, CC="gcc") == ("14", True)
    assert told(folder, cache, CC="cc") == ("14", True)


def test_without_a_compiler_the_remedy_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler, "find_spec", lambda _: None)
    with pytest.raises(compiler.CompilerError, match="no compiler of C is found"):
        compiler.compiler(tmp_path)
    without_headers(tmp_path)
    with pytest.raises(compiler.CompilerError, match=r"math\.h: No such file") as refused:
        compiler.compiler(tmp_path)
    assert "apt install gcc libc6-dev" in refused.value.remedy


def without_headers(folder: Path) -> None:
    """Writes a compiler that lacks the headers of C."""
    (folder / "cc").write_text("#!/bin/sh\necho 'math.h: No such file' >&2; exit 1\n")
    (folder / "cc").chmod(0o700)


def test_another_is_taken_for_one_that_does_not_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_headers(tmp_path)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler, "find_spec", lambda _: True)
    path = os.environ["PATH"]
    monkeypatch.setenv("PATH", str(tmp_path))
    assert compiler.compiler(tmp_path) == [sys.executable, "-m", "ziglang", "cc"]
    monkeypatch.setenv("PATH", f"{tmp_path}:{path}")
    assert compiler.compiler(tmp_path) == ["gcc"]


def test_the_compiler_of_the_user_comes_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "ccache gcc")
    assert compiler.compiler(tmp_path) == ["ccache", "gcc"]


@pytest.mark.parametrize(
    ("variable", "said", "told"),
    [
        ("CC", "'gcc", "CC is 'gcc: No closing quotation"),
        ("METACLOAK_CFLAGS", '-DX="a', "METACLOAK_CFLAGS is .*: No closing quotation"),
        ("CC", "true", "true .*made no library"),
    ],
)
def test_what_the_user_says_wrongly_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str, said: str, told: str
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv(variable, said)
    with pytest.raises(compiler.CompilerError, match=f"(?s){told}") as refused:
        compiler.load(loops(tmp_path))
    assert variable in refused.value.remedy


@pytest.mark.parametrize(("pins", "flag"), [(True, "-march=x86_64_v3"), (False, "-mcpu=baseline")])
def test_a_compiler_that_compiles_for_its_processor_is_told_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pins: bool, flag: str
) -> None:
    """Processors of several kinds share a folder of caches."""
    made: list[list[str]] = []
    monkeypatch.setattr(compiler, "compiler", lambda _: ["python", "-m", "ziglang", "cc"])
    monkeypatch.setattr(compiler, "can_pin", lambda: pins)
    monkeypatch.setattr(compiler, "_run_compiler", lambda _, command: made.append(command))
    compiler._compile(loops(tmp_path), tmp_path / "loops.so", ["-O3"])
    assert [word for word in made[0] if word.startswith("-m") and word != "-m"] == [flag]


def test_a_compiler_that_is_not_there_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("CC", "no_such_compiler")
    with pytest.raises(compiler.CompilerError, match="no_such_compiler cannot be run"):
        compiler.load(loops(tmp_path))


def test_a_full_disk_is_left_for_a_folder_for_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = tmp_path / "full"
    full.write_text(
        f'#!/bin/sh\ncase "$*" in *{tmp_path}/cache*)\n'
        'echo "ld: No space left on device" >&2; exit 1;; esac\nexec cc "$@"\n'
    )
    full.chmod(0o700)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setenv("CC", str(full))
    assert compiler.load(loops(tmp_path)).doubled(7) == 14
    assert not list((tmp_path / "cache").rglob("*.so"))


def test_only_the_folder_of_what_is_compiled_needs_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = tmp_path / "full"
    full.mkdir()
    program = tmp_path / "program"
    program.write_text(
        f'#!/bin/sh\n[ "$TMPDIR $LC_ALL" != "{full} C" ] && exec cc "$@"\n'
        "echo 'as: No space left on device' >&2; exit 1\n"
    )
    program.chmod(0o700)
    for name, value in {
        "TMPDIR": full,
        "XDG_CACHE_HOME": tmp_path / "cache",
        "CC": program,
    }.items():
        monkeypatch.setenv(name, str(value))
    monkeypatch.setenv("LC_ALL", "C")
    assert compiler.load(loops(tmp_path)).doubled(7) == 14
    assert list((tmp_path / "cache").rglob("*.so"))


@pytest.fixture
def no_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Lists folders that no code may be run from: that of caches, at first."""
    kept = [tmp_path / "cache"]
    load = ctypes.CDLL

    def refuse(path: str) -> ctypes.CDLL:
        if any(Path(path).is_relative_to(folder) for folder in kept):
            raise OSError(f"{path}: failed to map segment from shared object")
        return load(path)

    monkeypatch.setattr(ctypes, "CDLL", refuse)
    monkeypatch.setenv("XDG_CACHE_HOME", str(kept[0]))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return kept


@pytest.mark.usefixtures("no_code")
def test_a_library_for_a_while_is_found_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    folder = loops(tmp_path)
    for compiled in (2, 0):
        assert compiler.load(folder).doubled(7) == 14
        assert caplog.text.count("compiling loops") == compiled
        caplog.clear()


def test_a_folder_is_asked_for_where_none_is_of_use(tmp_path: Path, no_code: list[Path]) -> None:
    no_code.append(tmp_path / TEMPORARY_NAME)
    with pytest.raises(compiler.CompilerError, match="can be kept nowhere") as refused:
        compiler.load(loops(tmp_path))
    assert refused.value.remedy.startswith("set XDG_CACHE_HOME or TMPDIR")


def test_faults_of_the_source_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = loops(tmp_path)
    (folder / "double.c").write_text("long doubled(long n) { return many; }\n")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with pytest.raises(compiler.CompilerError, match=r"double.c:1:.*many"):
        compiler.load(folder)
    assert not list((tmp_path / "cache").rglob("*.so"))


def test_all_of_c_compiles_without_a_warning() -> None:
    if not shutil.which("gcc"):
        pytest.skip("these warnings are gcc's")
    for folder in (ROOT / "sim", ROOT / "pipeline"):
        files = [str(path) for path in compiler.sources(folder) if path.suffix == ".c"]
        command = ["gcc", "-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", f"-I{ROOT}"]
        done = subprocess.run(
            [*command, "-fsyntax-only", *files], capture_output=True, text=True, check=False
        )
        assert not done.returncode, done.stderr
