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
from pipeline.workflow.runs import study_lock
from tests.docs.pages import PLACE, Block, blocks, text
from tests.docs.walk import LAID_OVER, check_recording, checked

FAQ = blocks("docs/faq.md")


def each_yaml_of(page: str) -> pytest.MarkDecorator:
    """Parametrises a test by the examples of a page."""
    found = [block for block in blocks(page) if block.language == "yaml"]
    return pytest.mark.parametrize("block", found, ids=lambda block: block.text[:60])


@pytest.fixture
def problem(tmp_path: Path) -> Path:
    return tmp_path / "problem.yaml"


MISTAKES = [each for each in pairwise(FAQ) if [one.language for one in each] == ["yaml", "text"]]


@pytest.mark.parametrize(("block", "told"), MISTAKES, ids=lambda each: each.text[:60])
def test_a_mistake_is_told_as_the_page_says(block: Block, told: Block, problem: Path) -> None:
    shown = block.place.removeprefix(LAID_OVER)
    shutil.copy(ROOT / shown, problem)
    with pytest.raises(UserError) as caught:
        checked(block, problem)
    assert PLACE.sub("", f"error: {caught.value}\n") == PLACE.sub("", told.text)
    assert f"  file:   {shown}, line " in told.text


@each_yaml_of("docs/loads.md")
def test_drives_are_as_the_page_says(block: Block, problem: Path) -> None:
    (series,) = [each.text for each in blocks("docs/loads.md") if each.language == "text"]
    problem.with_name("shaker.csv").write_text(series)
    shutil.copy(ROOT / block.place.removeprefix(LAID_OVER), problem)
    checked(block, problem)


@pytest.mark.parametrize(
    ("phrase", "module"),
    [
        ("beyond a driven displacement of", failures),
        ("the first frame does not show this design", recognition),
        ("another run is at work on", study_lock),
    ],
)
def test_a_message_within_a_sentence_is_the_codes(phrase: str, module: ModuleType) -> None:
    assert f"`{phrase}`" in text("docs/faq.md")
    assert phrase in inspect.getsource(module)


@each_yaml_of("docs/tracking.md")
def test_a_recording_is_valid(block: Block, tmp_path: Path) -> None:
    check_recording(block, tmp_path)


@each_yaml_of("docs/printer.md")
def test_the_workshops_keys_are_valid(block: Block, problem: Path) -> None:
    shutil.copy(ROOT / "experiments/fig5/problem.yaml", problem)
    checked(block, problem)


def test_the_paper_is_cited_as_in_the_citation_file() -> None:
    cited = text("docs/cite.md")
    for line in text("CITATION.cff").splitlines():
        key, _, value = line.strip(" -").partition(": ")
        if key in ("family-names", "doi", "journal", "version", "value"):
            assert value in cited, line


@each_yaml_of("docs/sweeps.md")
def test_a_sweep_is_valid(block: Block, problem: Path) -> None:
    (section,) = yaml.safe_load(block.text).items()
    whole = yaml.safe_load((ROOT / block.place).read_text())
    problem.write_text(yaml.safe_dump(whole | dict([section])))
    assert getattr(load(problem), section[0]) is not None


@each_yaml_of("docs/robust.md")
def test_what_a_design_is_to_hold_against_is_valid(block: Block, problem: Path) -> None:
    """Laid over the file, as a preset is; a preset by itself is loaded as one."""
    given = yaml.safe_load(block.text)
    preset = next(iter(given.get("presets", {})), None)
    whole = yaml.safe_load((ROOT / block.place).read_text())
    problem.write_text(yaml.safe_dump(overlay_keys(whole, given)))
    assert load(problem, preset) != load(ROOT / block.place)
