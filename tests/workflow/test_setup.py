"""An environment from a folder of packages, without a network, by uv or by pip."""

import fcntl
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile, ZipInfo

import pytest

from pipeline.runtime import ROOT
from pipeline.workflow.install_lock import uv_settings
from tests.tables import cases

SECRET = "user:hunter2"
UV = "uv.data/scripts/uv"
PRETENDING = f"""#!/bin/sh
case "$*" in
*"-m pip install"*) echo "$*" >>told; exit "${{CODE:-0}}" ;;
*) exec "{sys.executable}" "$@" ;;
esac
"""
"""The Python of an environment, but that its pip only tells what it was asked for."""
TELLING = """#!python
import json, os, sys
told = {name: value for name, value in os.environ.items() if name[:3] in ("UV_", "SSL")}
with open("told.json", "w") as file:
    json.dump([sys.argv[1:], told], file)
"""


def wheel(folder: Path, name: str, files: dict[str, str], version: str = "1.0") -> str:
    """Packs a package; returns its line of a lock."""
    info = f"{name}-{version}.dist-info"
    about = {
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/RECORD": "",
    }
    path = folder / f"{name}-{version}-py3-none-any.whl"
    with ZipFile(path, "w") as packed:
        for place, text in {**files, **about}.items():
            entry = ZipInfo(place.replace(".data", f"-{version}.data"))
            entry.external_attr = 0o100755 << 16
            packed.writestr(entry, text)
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    return f"{name}=={version} \\\n    --hash=sha256:{found}\n"


def checkout(folder: Path) -> Path:
    """Puts what sets up into a folder."""
    script = Path("pipeline/workflow/install_lock.py")
    (folder / script.parent).mkdir(parents=True)
    shutil.copy(ROOT / script, folder / script)
    shutil.copy(ROOT / "Makefile", folder)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what sets up, whose environment is made once."""
    folder = checkout(tmp_path_factory.mktemp("checkout"))
    (folder / "wheels").mkdir()
    (folder / "USB stick").symlink_to("wheels")
    return folder


def own_environment() -> dict[str, str]:
    """Variables without those of `make test` and of installers."""
    others = ("MAKE", "MFL", "PIP_", "UV_")
    return {name: value for name, value in os.environ.items() if not name.startswith(others)}


@pytest.fixture
def pretended(tmp_path: Path) -> Path:
    """A folder with what sets up, whose environment is of an older lock and only pretends."""
    version = ".".join(map(str, sys.version_info[:2]))
    (tmp_path / f".venv/lib/python{version}/site-packages").mkdir(parents=True)
    (tmp_path / ".venv/bin").mkdir()
    (tmp_path / ".venv/bin/python").write_text(PRETENDING)
    (tmp_path / ".venv/bin/python").chmod(0o755)
    (tmp_path / ".venv/requirements.lock").write_text("older==1\n")
    os.utime(tmp_path / ".venv/requirements.lock", (1, 1))
    (tmp_path / "USB stick").mkdir()
    (tmp_path / "USB stick/nothing-1.whl").touch()
    (tmp_path / "requirements.lock").write_text("nothing==1\n")
    (tmp_path / "requirements-dev.lock").write_text("tool==1\n")
    (tmp_path / "requirements-compiler.lock").write_text("compiler==1\n")
    return checkout(tmp_path)


def start(folder: Path, *words: str, **variables: str) -> subprocess.Popen[str]:
    """Starts `make` with these words and variables of the environment."""
    return subprocess.Popen(
        ["make", *words],
        cwd=folder,
        env=own_environment() | variables,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def installed(folder: Path) -> list[str]:
    """Names the locks that pip was asked for."""
    told = folder / "told"
    return [line.split()[-1] for line in told.read_text().splitlines()] if told.exists() else []


def set_up(folder: Path, *lock: str, offline: bool = True) -> subprocess.CompletedProcess[str]:
    """`make setup` with these lines of a lock."""
    (folder / "requirements.lock").write_text("".join(lock))
    (folder / ".venv/requirements.lock").unlink(missing_ok=True)  # may be of the same moment
    return subprocess.run(
        ["make", "setup", *["WHEELS=USB stick"] * offline, f"PYTHON={sys.executable}"],
        cwd=folder,
        env=own_environment() | {"PIP_CONFIG_FILE": str(folder / "pip.conf"), "PIP_USER": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_a_folder_of_packages_is_enough(folder: Path) -> None:
    (folder / ".venv").symlink_to("on_a_larger_disk")
    line = wheel(folder / "wheels", "nothing", {"nothing.py": "value = 1\n"})
    ended = set_up(folder, line)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    subprocess.run([folder / ".venv/bin/python", "-c", "import nothing"], check=True)
    again = subprocess.check_output(["make", "setup"], cwd=folder, text=True)
    assert "Nothing to be done for 'setup'." in again


def test_uv_is_given_the_settings_of_pip_and_nobody_sees_them(folder: Path) -> None:
    line = wheel(folder / "wheels", "uv", {UV: TELLING})
    (folder / "pip.conf").write_text(
        f"[global]\nno-index = true\ncert = /of/all\nindex-url = https://{SECRET}@localhost/packages\n"
        f"[install]\nfind-links =\n    {folder}/wheels\n    /not/there\ncert = {folder}/pip.conf\n"
    )
    ended = set_up(folder, line, offline=False)
    (folder / "pip.conf").unlink()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    words, told = json.loads((folder / "told.json").read_text())
    assert SECRET not in ended.stdout + ended.stderr + " ".join(words)
    assert words[:4] == ["pip", "install", "--quiet", "--require-hashes"]
    assert "requirements.lock" in words
    wanted = {
        "UV_DEFAULT_INDEX": f"https://{SECRET}@localhost/packages",
        "UV_NO_INDEX": "true",
        "UV_FIND_LINKS": f"{folder}/wheels",
        "SSL_CERT_FILE": f"{folder}/pip.conf",
    }
    assert told.items() >= wanted.items()


def test_pip_installs_where_uv_fails(folder: Path) -> None:
    broken = wheel(folder / "wheels", "uv", {UV: "#!python\nraise SystemExit(3)\n"}, "2.0")
    other = wheel(folder / "wheels", "other", {"other.py": "value = 1\n"})
    ended = set_up(folder, broken, other)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "uv cannot install here, pip does" in ended.stderr
    subprocess.run([folder / ".venv/bin/python", "-c", "import other"], check=True)


def test_of_two_at_once_one_sets_up_and_the_other_waits(pretended: Path) -> None:
    turn = pretended / ".cache/.venv.turn"
    turn.parent.mkdir()
    with turn.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        both = [start(pretended, target) for target in ("setup", "dev")]
        for each in both:
            assert each.stderr
            assert "Waiting for another process" in each.stderr.readline()
    told = "".join(each.communicate()[1] for each in both)
    assert [each.returncode for each in both] == [0, 0], told
    assert installed(pretended) == ["requirements.lock", "requirements-dev.lock"]
    assert "Nothing to be done" in start(pretended, "dev").communicate()[0]


def test_an_interrupt_ends_it_with_one_line(pretended: Path) -> None:
    turn = pretended / ".cache/.venv.turn"
    turn.parent.mkdir()
    with turn.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        waiting = start(pretended, "setup")
        assert waiting.stderr
        assert "Waiting for another process" in waiting.stderr.readline()
        os.killpg(waiting.pid, signal.SIGINT)
        told = waiting.communicate()[1]
    assert waiting.returncode
    assert "Traceback" not in told
    assert "stopped: the same command goes on" in told


def test_a_lock_of_the_same_content_is_not_installed_again(pretended: Path) -> None:
    shutil.copy(pretended / ".venv/requirements.lock", pretended)
    assert start(pretended, "setup").wait() == 0
    assert installed(pretended) == []


def test_a_folder_of_packages_is_remembered_as_long_as_it_is_there(pretended: Path) -> None:
    for words in (["setup", "WHEELS=USB stick"], ["dev"]):
        assert start(pretended, *words).wait() == 0
    (pretended / "USB stick").rename(pretended / "elsewhere")
    (pretended / ".venv/requirements-dev.lock").unlink()
    assert start(pretended, "dev").wait() == 0
    asked = (pretended / "told").read_text().splitlines()
    taken = f"--no-index --find-links {pretended}/USB stick"
    assert [taken in each for each in asked] == [True, True, False]


@pytest.mark.parametrize(
    ("wheels", "told"),
    [
        ([], "then here: make setup WHEELS=folder"),
        (["WHEELS=USB stick"], "USB stick, which has to be made for Python 3"),
        (["WHEELS=nowhere"], "no packages are in the folder 'nowhere'"),
    ],
)
def test_what_cannot_be_installed_ends_with_one_message(
    pretended: Path, wheels: list[str], told: str
) -> None:
    ended = start(pretended, "setup", *wheels, CODE="1")
    said = ended.communicate()[1]
    assert ended.returncode == 2
    assert said.count("error: ") == 1
    assert told in said
    assert "uv cannot install here" not in said
    assert not (pretended / ".venv/requirements.lock").exists() or wheels == ["WHEELS=nowhere"]


def test_uv_keeps_no_cache_where_no_home_can_be_written(pretended: Path) -> None:
    uv = pretended / ".venv/bin/uv"
    uv.write_text('#!/bin/sh\necho "$UV_NO_CACHE" >>told\n')
    uv.chmod(0o755)
    ended = start(pretended, "setup", HOME="/dev/null", XDG_CACHE_HOME="")
    assert ended.wait() == 0
    assert (pretended / "told").read_text() == "1\n"


@pytest.mark.parametrize("works", [True, False])
def test_a_compiler_is_added_where_none_has_the_headers(pretended: Path, works: bool) -> None:
    programs = pretended / "programs"
    programs.mkdir()
    for name in ("cc", "gcc", "clang"):
        found = f'exec "{shutil.which("gcc")}" {"" if works else "-nostdinc"} "$@"'
        (programs / name).write_text(f"#!/bin/sh\n{found}\n")
        (programs / name).chmod(0o755)
    path = f"{programs}:{os.environ['PATH']}"
    told = start(pretended, "setup", PATH=path, CC="").communicate()[1]
    added = ["requirements-compiler.lock"]
    assert installed(pretended) == ["requirements.lock", *([] if works else added)], told


@pytest.mark.parametrize("made_in", ["here", "elsewhere"])
def test_an_environment_that_was_moved_is_told(tmp_path: Path, made_in: str) -> None:
    shutil.copy(ROOT / "Makefile", tmp_path)
    pip = tmp_path / ".venv/bin/pip"
    pip.parent.mkdir(parents=True)
    folder = tmp_path if made_in == "here" else tmp_path.with_name("other")
    pip.write_text(f'#!/bin/sh\n\'\'\'exec\' "{folder}/.venv/bin/python" "$0" "$@"\n')
    ended = subprocess.run(
        ["make", "help"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert ("made in another folder" in ended.stderr) is (made_in == "elsewhere")


@pytest.mark.parametrize(
    ("version", "told"),
    [
        ("2.7.18", "this needs Python 3.11, 3.12 or 3.13, but './other' is Python 2.7.18."),
        ("3.14.0", "this needs Python 3.11, 3.12 or 3.13, but './other' is Python 3.14.0."),
        (None, "this needs Python 3.11, 3.12 or 3.13, but './other' is not here."),
    ],
)
@pytest.mark.parametrize("target", ["setup", "wheels"])
def test_other_pythons_are_refused(
    pretended: Path, target: str, version: str | None, told: str
) -> None:
    shutil.rmtree(pretended / ".venv")
    if version:
        found = f"import sys; sys.version_info = {tuple(map(int, version.split('.')))}"
        (pretended / "other").write_text(
            f'#!/bin/sh\n[ "$1" = -c ] || {{ echo Python {version} >&2; exit; }}\n'
            f'exec "{sys.executable}" -c "{found}; $2"\n'
        )
        (pretended / "other").chmod(0o755)
    ended = start(pretended, target, "PYTHON=./other")
    assert told in ended.communicate()[1]
    assert ended.returncode == 2


def test_an_environment_that_is_there_stays_with_its_python(pretended: Path) -> None:
    assert start(pretended, "setup", "PYTHON=/not/there").wait() == 0
    assert installed(pretended) == ["requirements.lock"]


@pytest.mark.parametrize("found", ["its Python", "no Python", "a newer Python"])
def test_a_python_that_has_gone_is_told(pretended: Path, found: str) -> None:
    python = pretended / ".venv/bin/python"
    if found == "a newer Python":
        (made_by,) = (pretended / ".venv/lib").iterdir()
        made_by.rename(made_by.with_name("python3.1"))
    if found == "no Python":
        python.unlink()
        python.symlink_to("/not/there/python3.1")
    said = start(pretended, "help").communicate()[1]
    assert ("the Python of .venv is not here any more" in said) is (found != "its Python")


def test_modules_of_a_cluster_hide_nothing(pretended: Path) -> None:
    with (pretended / "Makefile").open("a") as file:
        file.write("shown:\n\t@env\n")
    shown = start(pretended, "shown", PYTHONPATH="/of/a/module", PYTHONHOME="/of/a/module")
    assert "/of/a/module" not in shown.communicate()[0]


@pytest.mark.parametrize("target", ["publish", "index"])
def test_a_run_takes_the_place_of_the_shell_of_make(pretended: Path, target: str) -> None:
    """Signals to what make began would end the shell alone."""
    told = start(pretended, "--dry-run", target).communicate()[0]
    (run,) = (line for line in told.splitlines() if "pipeline run" in line)
    assert run.startswith("exec ")
    assert "&&" not in run


def test_a_preset_without_a_name_is_no_target(pretended: Path) -> None:
    problem = pretended / "experiments/fig2/problem.yaml"
    problem.parent.mkdir(parents=True)
    problem.touch()
    assert "No rule to make target 'fig2@'" in start(pretended, "fig2@").communicate()[1]


@cases("workflow", "listed, settings")
def test_settings_of_pip_become_those_of_uv(listed: str, settings: dict[str, str]) -> None:
    assert uv_settings(listed) == settings


@pytest.mark.parametrize("name", ["copy of mine", "a:b", "a%b", "a#b", "a=b", "a(b", "a'b", "a$b"])
def test_a_folder_that_is_no_study_leaves_make_alone(name: str, tmp_path: Path) -> None:
    """In a checkout whose own path has a space."""
    place = checkout(tmp_path / "my folder")
    for study in ("mine", "of_units", name):
        (place / "experiments" / study).mkdir(parents=True)
        (place / "experiments" / study / "problem.yaml").touch()
    told = subprocess.run(
        ["make", "help"],
        cwd=place,
        env=own_environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert "(studies here: mine of_units)" in told.stdout
    assert told.stderr == ""
