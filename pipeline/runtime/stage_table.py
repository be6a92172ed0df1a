"""Reads stage_table.toml: the stages, from which the command line, the rules and hashes follow."""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

_TYPES = {"int": int, "float": float}


class Option(NamedTuple):
    """Holds an option of a command line: its names and what `argparse` is to do with it."""

    names: tuple[str, ...]
    settings: Mapping[str, Any]


def option(*names: str, **settings: Any) -> Option:  # noqa: ANN401  (argparse's own)
    """Makes an option from the arguments of `ArgumentParser.add_argument`."""
    return Option(names, settings)


class Stage(NamedTuple):
    """Describes a stage; stage_table.toml tells what its attributes mean."""

    name: str
    does: str
    home: str = "pipeline.stages"
    module_name: str = ""
    kind: str | None = None
    datasets: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    unused: tuple[str, ...] | None = None
    threads: str = ""
    options: tuple[Option, ...] = ()
    parts: Mapping[str, tuple[Option, ...]] = {}
    about: str = ""
    passes_on: bool = False
    extra: str = "workflow"

    @property
    def module(self) -> str:
        """Full name of the stage's module."""
        return f"{self.home}.{self.module_name or self.name}"


_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def _option(name: str, file: str = "", type: str = "", **settings: Any) -> Option:  # noqa: A002, ANN401
    if file:
        settings |= {"metavar": file, "type": Path}
    elif type:
        settings["type"] = _TYPES[type]
    return option(name, **settings)


def _options(asked: Iterable[str | dict[str, Any]]) -> tuple[Option, ...]:
    known = _TABLE["options"]
    rows = ({"name": each, **known[each]} if isinstance(each, str) else each for each in asked)
    return tuple(_option(**row) for row in rows)


def _sections(asked: Iterable[str]) -> tuple[str, ...]:
    return tuple(name for each in asked for name in _TABLE["groups"].get(each, [each]))


def _stage(name: str, row: Mapping[str, Any]) -> Stage:
    lists = {key: tuple(row[key]) for key in ("datasets", "inputs") if key in row}
    unused = {"unused": _sections(row["unused"])} if "unused" in row else {}
    parts = {part: _options(each) for part, each in row.get("parts", {}).items()}
    made = {"options": _options(row.get("options", ())), "parts": parts}
    return Stage(name, **{**row, **lists, **unused, **made})


PROBLEM = _options(("--problem", "--preset"))
"""Options by which a stage finds its problem."""

STAGES: Mapping[str, Stage] = {name: _stage(name, row) for name, row in _TABLE["stages"].items()}

REPORTED: Mapping[str, Stage] = {name: row for row in STAGES.values() for name in row.datasets}
"""The stages by the datasets that a study's report reads."""
