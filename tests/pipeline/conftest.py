from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.__main__ import run_stage
from pipeline.problem.reading import load
from pipeline.runtime import UserError
from tests.pipeline.static import HOLE, designed, write

FIG2 = Path(__file__).parents[2] / "experiments/fig2/problem.yaml"


@pytest.fixture(scope="session")
def fig2() -> Path:
    """The problem file of Figure 2."""
    return FIG2


@pytest.fixture(scope="session")
def hole(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Options that name a small problem with a void; its design is beside it."""
    path = write(tmp_path_factory.mktemp("hole"), HOLE, size=5, amplitude=3.0)
    designed(path)
    return ["--problem", str(path), "--quiet", "--out"]


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


Failing = Callable[..., str]


@pytest.fixture
def failing(capfd: pytest.CaptureFixture[str]) -> Failing:
    """Runs a stage that ends with one message and writes nothing; returns the message."""

    def told(stage: str, words: list[str]) -> str:
        out = Path(words[words.index("--out") + 1]) if "--out" in words else None
        before = out.read_bytes() if out and out.exists() else None
        assert run_stage(stage, words) == 2
        error = capfd.readouterr().err
        assert error.count("error: ") == 1
        assert "remedy:" in error
        assert "Traceback" not in error
        assert out is None or (out.read_bytes() if out.exists() else None) == before
        return error

    return told
