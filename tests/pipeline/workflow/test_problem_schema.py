import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from pipeline.__main__ import run_stage
from pipeline.workflow import problem_schema
from tests.tables import cases

Problem = dict[str, Any]


@pytest.fixture
def content(fig2: Path) -> Problem:
    """What fig2's problem file holds."""
    content: Problem = yaml.safe_load(fig2.read_bytes())
    return content


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    """A validator of problem files."""
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
