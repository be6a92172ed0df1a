from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.__main__ import run_stage
from pipeline.problem.reading import load
from pipeline.runtime import UserError
from tests.pipeline.static import HOLE, write

FIG2 = Path(__file__).parents[2] / "experiments/fig2/problem.yaml"


@pytest.fixture(scope="session")
def fig2() -> Path:
    """The problem file of Figure 2."""
    return FIG2


@pytest.fixture(scope="session")
def hole(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Options that name a small problem with a void; its design is beside it."""
    folder = tmp_path_factory.mktemp("hole")
    options = ["--problem", str(write(folder, HOLE, size=5, amplitude=3.0)), "--quiet", "--out"]
    made = str(folder / "design_sqp.nc")
    assert run_stage("design", [*options, made, "--method", "sqp"]) == 0
    assert run_stage("select", [*options, str(folder / "design.nc"), "--designs", made]) == 0
    return options


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
