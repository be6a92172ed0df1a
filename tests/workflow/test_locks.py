"""The locks pin what pyproject.toml asks for, with hashes, and name no host."""

import re
import tomllib

import pytest

from pipeline.runtime import ROOT

LOCKS = ("requirements.lock", "requirements-dev.lock", "requirements-compiler.lock")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]


def pins(lock: str) -> dict[str, str]:
    """The versions of a lock by package."""
    found = re.findall(r"^([\w.-]+)==(\S+) \\$", (ROOT / lock).read_text(), re.MULTILINE)
    return {name.lower(): version for name, version in found}


def asked(extra: str) -> set[str]:
    """The packages that an extra asks for, those of the extras that it names among them."""
    found: set[str] = set()
    for line in EXTRAS[extra]:
        name, own = re.match(r"([\w.-]+)(?:\[(.*)\])?", line).groups()  # type: ignore[union-attr]
        if name == PROJECT["name"]:
            found = found.union(*map(asked, (own or "").split(",")))
        else:
            found.add(re.sub("[._]", "-", name).lower())
    return found


@pytest.mark.parametrize("lock", LOCKS)
def test_every_pin_has_hashes_and_no_host_is_named(lock: str) -> None:
    text = (ROOT / lock).read_text()
    lines = [line for line in text.splitlines() if line and not line.lstrip().startswith("#")]
    pinned = [line for line in lines if not line.startswith(" ")]
    assert len(pinned) == len(pins(lock)) > 0
    assert all(re.fullmatch(r" +--hash=sha256:[0-9a-f]{64}( \\)?", x) for x in lines if x[0] == " ")
    assert "://" not in text
    assert "index" not in text


@pytest.mark.parametrize(
    ("lock", "extra"), [(LOCKS[0], "all"), (LOCKS[1], "dev"), (LOCKS[2], "compiler")]
)
def test_a_lock_pins_what_its_extra_asks_for(lock: str, extra: str) -> None:
    assert asked(extra) <= pins(lock).keys()


def test_the_lock_of_the_compiler_adds_nothing_else() -> None:
    assert pins(LOCKS[2]).keys() == asked("compiler")


def test_tests_run_with_the_versions_of_users() -> None:
    used, developed = pins(LOCKS[0]), pins(LOCKS[1])
    assert used.items() <= developed.items()
