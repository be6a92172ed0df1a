"""Tries damaged files in small; `python -m tests.hostile inputs` tries a thousand."""

import pytest

from tests.hostile import inputs
from tests.hostile.subjects import SUBJECTS


@pytest.mark.slow
def test_no_damaged_file_is_read_in_silence_or_ends_in_a_traceback() -> None:
    found = inputs.outcomes(len(SUBJECTS), seed=7)
    assert [each for each in found if each["end"] == "wrong"] == []
    assert len(found) == len(SUBJECTS)
    assert {each["end"] for each in found} == {"refused", "same", "changed"}
