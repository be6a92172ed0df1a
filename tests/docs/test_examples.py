"""YAML on the pages is what the pages say of it; messages are the code's own."""

import inspect
import shutil
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import pytest
import yaml

from pipeline.posing import failures
from pipeline.problem.reading import load, overlay_keys
from pipeline.runtime import ROOT, UserError
from pipeline.tracking.reference_frame import recognition
from pipeline.workflow import run
from tests.docs.pages import PLACE, Block, blocks, text
from tests.docs.walk import LAID_OVER, check_recording, checked

FAQ = blocks("docs/faq.md")


def yaml_of(page: str) -> list[Block]:
    """The examples of a page."""
    return [block for block in blocks(page) if block.language == "yaml"]


MISTAKES = [
    (block, told)
    for block, told in pairwise(FAQ)
    if (block.language, told.language) == ("yaml", "text")
]


@pytest.mark.parametrize(("block", "told"), MISTAKES, ids=lambda each: each.text[:60])
def test_a_mistake_is_told_as_the_page_says(block: Block, told: Block, tmp_path: Path) -> None:
    shown = block.place.removeprefix(LAID_OVER)
    problem = tmp_path / "problem.yaml"
    shutil.copy(ROOT / shown, problem)
    with pytest.raises(UserError) as caught:
        checked(block, problem)
    assert PLACE.sub("", f"error: {caught.value}\n") == PLACE.sub("", told.text)
    assert f"  file:   {shown}, line " in told.text


@pytest.mark.parametrize("block", yaml_of("docs/loads.md"), ids=lambda each: each.text[:60])
def test_drives_are_as_the_page_says(block: Block, tmp_path: Path) -> None:
    (series,) = [each.text for each in blocks("docs/loads.md") if each.language == "text"]
    (tmp_path / "shaker.csv").write_text(series)
    problem = tmp_path / "problem.yaml"
    shutil.copy(ROOT / block.place.removeprefix(LAID_OVER), problem)
    checked(block, problem)


@pytest.mark.parametrize(
    ("phrase", "module"),
    [
        ("beyond a driven displacement of", failures),
        ("the first frame does not show this design", recognition),
        ("snakemake is already at work in this folder", run),
    ],
)
def test_a_message_within_a_sentence_is_the_codes(phrase: str, module: ModuleType) -> None:
    assert f"`{phrase}`" in text("docs/faq.md")
    assert phrase in inspect.getsource(module)


@pytest.mark.parametrize(
    "block",
    [block for block in blocks("docs/tracking.md") if block.language == "yaml"],
    ids=lambda block: block.place,
)
def test_a_recording_is_valid(block: Block, tmp_path: Path) -> None:
    check_recording(block, tmp_path)


def test_the_workshops_keys_are_valid(tmp_path: Path) -> None:
    problem = tmp_path / "problem.yaml"
    shutil.copy(ROOT / "experiments/fig5/problem.yaml", problem)
    (block,) = (block for block in blocks("docs/printer.md") if block.language == "yaml")
    checked(block, problem)


def test_the_paper_is_cited_as_in_the_citation_file() -> None:
    cited = text("docs/cite.md")
    for line in text("CITATION.cff").splitlines():
        key, _, value = line.strip(" -").partition(": ")
        if key in ("family-names", "doi", "journal", "version", "value"):
            assert value in cited, line


@pytest.mark.parametrize("block", yaml_of("docs/sweeps.md"), ids=lambda block: block.place)
def test_a_sweep_is_valid(block: Block, tmp_path: Path) -> None:
    problem = tmp_path / "problem.yaml"
    (section,) = yaml.safe_load(block.text).items()
    whole = yaml.safe_load((ROOT / block.place).read_text())
    problem.write_text(yaml.safe_dump(whole | dict([section])))
    assert getattr(load(problem), section[0]) is not None


@pytest.mark.parametrize("block", yaml_of("docs/robust.md"), ids=lambda block: block.text[30:60])
def test_what_a_design_is_to_hold_against_is_valid(block: Block, tmp_path: Path) -> None:
    """Laid over the file, as a preset is; a preset by itself is loaded as one."""
    problem = tmp_path / "problem.yaml"
    given = yaml.safe_load(block.text)
    preset = next(iter(given.get("presets", {})), None)
    whole = yaml.safe_load((ROOT / block.place).read_text())
    problem.write_text(yaml.safe_dump(overlay_keys(whole, given)))
    assert load(problem, preset) != load(ROOT / block.place)
