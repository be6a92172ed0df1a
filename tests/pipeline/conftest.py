from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.errors import UserError
from pipeline.problem import load

FIG2 = Path(__file__).parents[2] / "experiments/fig2/problem.yaml"


@pytest.fixture(scope="session")
def fig2() -> Path:
    """The problem file of Figure 2."""
    return FIG2


Refusal = Callable[..., UserError]


@pytest.fixture
def refusal(tmp_path: Path) -> Refusal:
    """The error that fig2's problem file gives after replacing `old` by `new` in its text."""

    def refused(old: str, new: str, preset: str | None = None) -> UserError:
        text = FIG2.read_text(encoding="utf-8")
        assert old in text
        path = tmp_path / "problem.yaml"
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
        with pytest.raises(UserError) as caught:
            load(path, preset)
        error = caught.value
        assert error.file == str(path)
        assert error.remedy
        assert len(str(error).splitlines()) <= 5
        return error

    return refused
