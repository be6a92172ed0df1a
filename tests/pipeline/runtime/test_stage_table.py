"""One table: what it says of stages is so in the rules, and commands are found in it."""

import re
import subprocess
import sys

import pytest

from pipeline.__main__ import main, overview
from pipeline.datasets.tables import TABLES
from pipeline.problem import Problem
from pipeline.runtime import ROOT, STAGES, Stage
from pipeline.runtime.cli import command_line

HEAVY = ("jax", "numpy", "pydantic", "xarray", "yaml", "cv2", "matplotlib")


@pytest.mark.parametrize("stage", STAGES.values(), ids=lambda stage: stage.name)
def test_a_row_names_what_there_is(stage: Stage) -> None:
    source = ROOT.joinpath(*stage.module.split(".")).with_suffix(".py")
    assert "\ndef work(" in source.read_text(encoding="utf-8")
    assert stage.kind is None or stage.kind in TABLES
    assert set(stage.unused or ()) <= Problem.model_fields.keys()
    assert stage.name in overview()


def test_a_rule_bears_the_name_of_its_stage() -> None:
    ran = set()
    for path in ROOT.glob("pipeline/rules/*.smk"):
        rules = re.split(r"^rule (\w+):", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        for name, body in zip(rules[1::2], rules[2::2], strict=True):
            if (run := re.search(r"python -m pipeline (\w+)", body)) is not None:
                ran.add(run[1])
                assert name == run[1] or name.startswith(f"{run[1]}_")
                assert f'source_hash("{STAGES[run[1]].module}")' in body
    assert ran == {name for name, row in STAGES.items() if row.home == "pipeline.stages"}


@pytest.mark.parametrize("words", [["--help"], ["design", "--help"], ["film", "plan", "--help"]])
def test_help_loads_nothing_heavy(words: list[str]) -> None:
    script = (
        "import sys\nfrom pipeline.__main__ import main\n"
        "try:\n    main(sys.argv[1:])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        f"print('loaded', [name for name in {HEAVY} if name in sys.modules])"
    )
    told = subprocess.check_output([sys.executable, "-c", script, *words], text=True)
    assert told.endswith("loaded []\n")
    assert "usage: python -m pipeline" in told


def test_the_help_of_what_passes_its_words_on_has_no_option_of_ours() -> None:
    told = {name: command_line(STAGES[name]).format_help() for name in ("run", "check")}
    assert "--quiet" in told["check"]
    assert "--quiet" not in told["run"]
    assert "--log" not in told["run"]


def test_a_stage_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulat"]) == 2
    assert "did you mean simulate?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new"), [("pipeline.reconsider", "redesign"), ("pipeline.reference", "reference")]
)
def test_an_old_command_runs_with_a_note(old: str, new: str) -> None:
    command = [sys.executable, "-m", old, "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == f"note: python -m {old} is now python -m pipeline {new}\n"
    assert f"usage: python -m pipeline {new}" in done.stdout
