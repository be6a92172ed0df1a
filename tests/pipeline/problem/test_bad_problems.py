from pathlib import Path

import pytest

from pipeline.problem.reading import load, preset_names
from pipeline.runtime import UserError
from tests.pipeline.conftest import Refusal
from tests.tables import cases, refused


@cases("problem", "old, new, key, what, remedy")
def test_a_mistake_is_told(
    refusal: Refusal, old: str, new: str, key: str, what: str, remedy: str
) -> None:
    error = refusal(old, new)
    assert what in error.what
    assert error.key == key
    assert remedy in str(error.remedy)
    assert error.line is not None


def test_line_and_value_are_those_of_the_file_or_preset(refusal: Refusal, fig2: Path) -> None:
    lines = fig2.read_text(encoding="utf-8").splitlines()

    def line(text: str) -> int:
        return 1 + next(index for index, line in enumerate(lines) if text in line)

    error = refusal("axial_stiffness: 120 N/mm", "axial_stiffness: -120 N/mm")
    assert (error.line, error.value) == (line("axial_stiffness"), "-120 N/mm")
    error = refusal("edge_length: 3 mm", "edge_length: 30 mm", "edge3")
    assert error.key == "presets.edge3.constraints.edge_length"
    assert error.line == line("edge_length: 3 mm")
    error = refusal("spacing: 15 mm", f"spacing: {'9' * 5000} m m m")
    assert max(map(len, str(error).splitlines())) < 200


@pytest.mark.parametrize(
    ("made", "key", "value"),
    [
        ("shims: {tabs: {}}\n  laser:\n    kerf: 3 mm", "laser.kerf", "3 mm"),
        ("thickness: 2 mm\n  labels:\n    depth: 1.5 mm", "labels.depth", "1.5 mm"),
        ("laser.kerf: 3 mm", "laser.kerf", "3 mm"),
    ],
)
def test_a_fault_between_keys_has_line_and_value(
    refusal: Refusal, made: str, key: str, value: str
) -> None:
    text = f"fabrication:\n  {made}\n"
    error = refusal("constraints:", f"{text}constraints:")
    lines = Path(str(error.file)).read_text(encoding="utf-8").splitlines()
    assert (error.key, error.value) == (f"fabrication.{key}", value)
    assert lines[int(str(error.line)) - 1].endswith(value)


def test_an_unknown_preset_lists_those_there_are(fig2: Path) -> None:
    with pytest.raises(UserError, match="no preset 'quik'") as caught:
        load(fig2, "quik")
    told = f"did you mean 'quick'? presets here: {', '.join(preset_names(fig2))}"
    assert caught.value.remedy == told


def test_presets_are_mappings(refusal: Refusal) -> None:
    assert refusal("\npresets:", "\npresets: 3\nrest:", "quick").key == "presets"
    assert refusal("\npresets:", "\npresets: [quick]\nrest:").key == "presets"
    assert refusal("  edge3:\n    title", "  edge3: 3\n  x:\n    title", "edge3").line is not None


def test_a_drive_comes_before_the_horizon_ends(refusal: Refusal) -> None:
    error = refusal("delay: 100 ms", "delay: 900 ms", "pulse")
    assert error.what == "the drive comes at 0.87 s, after the horizon, which ends at 0.4 s"
    assert error.key == "presets.pulse.drive.delay"


@pytest.mark.parametrize(
    ("old", "new", "preset", "what", "key", "remedy"),
    [
        (
            "  periods: 2\n  samples: 200", "  periods: 10\n  samples: 11", None,
            "11 samples in 5 s are too few to see a period of 0.5 s",
            "horizon.samples", "give 60 or more",
        ),
        (
            "  cycles: 4\n  samples: 401", "  cycles: 40\n  samples: 201", None,
            "201 samples in 20 s are too few to see a period of 0.5 s",
            "response.samples", "give 240 or more",
        ),
        (
            "      duration: 400 ms", "      duration: 7 s", "pulse",
            "200 samples in 7 s are too few to see a push that is 0.03 s wide",
            "horizon.samples", "give 234 or more",
        ),
    ],
)  # fmt: skip
def test_samples_see_the_load(
    refusal: Refusal, old: str, new: str, preset: str | None, what: str, key: str, remedy: str
) -> None:
    error = refusal(old, new, preset)
    assert (error.what, error.key, error.remedy) == (what, key, remedy)


@cases("problem", "text, what, line")
def test_text_that_is_no_problem(tmp_path: Path, text: str, what: str, line: int | None) -> None:
    path = tmp_path / "problem.yaml"
    path.write_text(text, encoding="utf-8")
    with refused(what) as caught:
        load(path)
    assert line in (None, caught.value.line)


def test_a_file_must_be_there_and_be_text(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        load(tmp_path / "none.yaml")
    with pytest.raises(UserError, match="a folder"):
        load(tmp_path)
    (tmp_path / "latin.yaml").write_bytes(b"title: \xe4\n")
    with pytest.raises(UserError, match="not a UTF-8 text"):
        load(tmp_path / "latin.yaml")
