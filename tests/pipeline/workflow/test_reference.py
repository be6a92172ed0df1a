"""The pages that follow from the code do follow from it."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from pipeline.__main__ import run_stage
from pipeline.runtime import ROOT
from pipeline.workflow import problem_schema
from pipeline.workflow.reference.write_pages import pages
from tests.tables import cases

NAMES = ("api.md", "datasets.md", "keys.md", "keys_calibrations.md", "keys_recordings.md")


@pytest.mark.parametrize("name", NAMES)
def test_the_committed_page_is_up_to_date(name: str) -> None:
    committed = (ROOT / "docs" / name).read_text(encoding="utf-8")
    assert committed == pages()[name], "run python -m pipeline reference"


def test_the_command_writes_them(tmp_path: Path) -> None:
    assert run_stage("reference", ["--folder", str(tmp_path)]) == 0
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == pages()


def test_every_variable_and_every_section_has_its_place() -> None:
    row = "| `displacement` | structure, case, time, unit, dof | mm (ux, uy), rad (theta) |"
    assert row in pages()["datasets.md"]
    keys = pages()["keys.md"] + pages()["keys_recordings.md"]
    for row in (
        "| `spacing` | length (`mm`) |  | of the units, or of the cells. |",
        "| `cell_angle` | angle (`deg`) | `90 deg` |",
        "| `sheet` | pair, each length (`mm`) | `[600 mm, 300 mm]` |",
        "| `window` | [Window](#window) | see there |",
        "| `geometric` | [Method](#method) | `evaluations: 60` |",
    ):
        assert row in keys


@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("keys")])
def test_every_key_has_a_meaning(name: str) -> None:
    for line in pages()[name].splitlines():
        if line.startswith("| `"):
            meaning = line.rsplit("|", 2)[1].strip()
            assert meaning, line
            assert not meaning.endswith("with its unit"), line


Problem = dict[str, Any]


@pytest.fixture
def content(fig2: Path) -> Problem:
    """Loads fig2's problem file."""
    content: Problem = yaml.safe_load(fig2.read_bytes())
    return content


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    jsonschema.Draft202012Validator.check_schema(problem_schema.schema())
    return jsonschema.Draft202012Validator(problem_schema.schema())


def test_the_committed_schema_is_up_to_date(fig2: Path) -> None:
    committed = fig2.parents[1] / problem_schema.DEFAULT.name
    assert committed.read_text(encoding="utf-8") == problem_schema.text(), (
        "run python -m pipeline schema"
    )


def test_the_command_writes_it(tmp_path: Path) -> None:
    assert run_stage("schema", ["--out", str(tmp_path / "schema.json")]) == 0
    assert json.loads((tmp_path / "schema.json").read_bytes()) == problem_schema.schema()


@cases("workflow", "keys, value")
def test_mistakes_break_it(
    keys: list[str], value: object, validator: jsonschema.Draft202012Validator, content: Problem
) -> None:
    assert validator.is_valid(content)
    section = content
    for key in keys[:-1]:
        section = section[key]
    section[keys[-1]] = value
    assert not validator.is_valid(content)
