"""The pages that follow from the code do follow from it."""

from pathlib import Path

import pytest

from pipeline.__main__ import run_stage
from pipeline.runtime import ROOT
from pipeline.workflow.reference.write_pages import pages

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
