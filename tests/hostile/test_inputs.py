"""Tries damaged files in small; `python -m tests.hostile inputs` tries a thousand."""

from pathlib import Path

import pytest

from tests.hostile import inputs
from tests.hostile.subjects import SUBJECTS


@pytest.mark.slow
def test_no_damaged_file_is_read_in_silence_or_ends_in_a_traceback() -> None:
    found = inputs.outcomes(len(SUBJECTS), seed=7)
    assert [each for each in found if each["end"] == "wrong"] == []
    assert len(found) == len(SUBJECTS)
    assert {each["end"] for each in found} == {"refused", "same", "changed"}


def test_a_whole_manifest_is_read(tmp_path: Path) -> None:
    (manifest,) = (each for each in SUBJECTS if each.name == "manifest of a package")
    assert manifest.read(manifest.make(tmp_path))
