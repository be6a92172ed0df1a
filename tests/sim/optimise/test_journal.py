import logging
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.core import SimulationError
from sim.optimise import Journal, JournalInUseError, MmaOptions, SqpOptions, minimise
from sim.optimise.minimisation import Method
from tests.sim.optimise.known_problems import in_disc, rosenbrock
from tests.tables import some

Complete = tuple[bytes, tuple, int]
OPTIONS = SqpOptions(evaluations=12, retreats=0)
METHODS: dict[Method, SqpOptions | MmaOptions] = {"sqp": OPTIONS, "mma": MmaOptions(evaluations=12)}


class Counted:
    """A loss that counts its calls, fails once, and can die like a killed process."""

    def __init__(self, dies_at: int | None = None) -> None:
        self.calls = 0
        self.dies_at = dies_at

    def __call__(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        if self.calls == self.dies_at:
            raise KeyboardInterrupt
        self.calls += 1
        if 0 < x[0] + 0.45 < 0.1:
            raise SimulationError("step 7 failed at unit 3")
        value, slope, _ = rosenbrock(x)
        return value, slope, np.array([[value, 2 * value], [0.0, np.inf]])


def run(path: Path, loss: Counted, key: str = "a", method: Method = "sqp") -> tuple:
    start = np.array([-1.0, 0.5])
    with Journal(path, key) as journal:
        found = minimise(method, journal.wrap(loss), in_disc, start, options=METHODS[method])
    record = [(e.x.tobytes(), e.loss, e.accepted, e.radius, e.failure) for e in found.evaluations]
    return found.x.tobytes(), repr(record), journal.replayed


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Complete:
    """Bytes of the journal of an uninterrupted run, its outcome, and its number of evaluations."""
    path = tmp_path_factory.mktemp("journal") / "run"
    loss = Counted()
    outcome = run(path, loss)
    assert "step 7 failed at unit 3" in outcome[1]
    return path.read_bytes(), outcome, loss.calls


def record_starts(data: bytes) -> list[int]:
    """Offsets of all records, the key's first."""
    starts = [0]
    while starts[-1] < len(data):
        length = int.from_bytes(data[starts[-1] + 4 : starts[-1] + 12], "little")
        starts.append(starts[-1] + 16 + length)
    return starts


def test_a_complete_journal_replays_everything(complete: Complete, tmp_path: Path) -> None:
    data, outcome, calls = complete
    (tmp_path / "run").write_bytes(data)
    loss = Counted()
    again = run(tmp_path / "run", loss)
    assert again[:2] == outcome[:2]
    assert loss.calls == 0
    assert again[2] == calls
    assert (tmp_path / "run").read_bytes() == data


def test_a_cut_in_the_last_record_loses_one_evaluation(complete: Complete, tmp_path: Path) -> None:
    data, outcome, _ = complete
    last = record_starts(data)[-2]
    path = tmp_path / "run"
    for length in range(last, len(data)):
        path.write_bytes(data[:length])
        loss = Counted()
        assert run(path, loss)[:2] == outcome[:2]
        assert loss.calls == 1
        assert path.read_bytes() == data


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_a_flipped_bit_anywhere_ends_in_the_same_result(
    complete: Complete, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    content, outcome, _ = complete
    position = data.draw(st.integers(0, len(content) - 1))
    bit = data.draw(st.integers(0, 7))
    damaged = bytearray(content)
    damaged[position] ^= 1 << bit
    path = tmp_path_factory.mktemp("flip") / "run"
    path.write_bytes(bytes(damaged))
    assert run(path, Counted())[:2] == outcome[:2]
    assert path.read_bytes() == content


@pytest.mark.parametrize(
    ("method", "dies_at"), some([*product(METHODS, (5, 0, 1)), ("mma", 11)], 4)
)
def test_interrupted_runs_resume_in_place(tmp_path: Path, method: Method, dies_at: int) -> None:
    whole, loss = Counted(), Counted()
    outcome = run(tmp_path / "whole", whole, method=method)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "killed", Counted(dies_at), method=method)
    assert run(tmp_path / "killed", loss, method=method)[:2] == outcome[:2]
    assert loss.calls == whole.calls - dies_at
    assert (tmp_path / "killed").read_bytes() == (tmp_path / "whole").read_bytes()


def test_a_foreign_journal_is_kept_beside_and_started_anew(
    complete: Complete, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    data, _, calls = complete
    (tmp_path / "run").write_bytes(data)
    loss = Counted()
    assert run(tmp_path / "run", loss, key="b")[2] == 0
    assert loss.calls == calls
    assert f"{calls} evaluations of another problem or program, kept as run.old" in caplog.text
    assert (tmp_path / "run.old").read_bytes() == data
    for key in "ab":
        with Journal(tmp_path / "empty", key):
            pass
    assert not (tmp_path / "empty.old").exists()
    (tmp_path / "run").write_bytes(b"EVAL" + b"\xff" * 200)
    loss = Counted()
    run(tmp_path / "run", loss)
    assert loss.calls == OPTIONS.evaluations


def test_a_design_that_differs_cuts_the_rest_and_says_so(
    complete: Complete, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    data, _, _ = complete
    path = tmp_path / "run"
    path.write_bytes(data)
    loss = Counted()
    with caplog.at_level(logging.WARNING), Journal(path, "a") as journal:
        remembered = journal.wrap(loss)
        remembered(np.array([-1.0, 0.5]))
        remembered(np.array([-0.1, 0.2]))
        remembered(np.array([-0.3, 0.1]))
    assert loss.calls == 2
    assert "evaluation 1 differs" in caplog.text
    assert len(record_starts(path.read_bytes())) == 1 + 4


def test_aux_keeps_its_shape_and_bits(tmp_path: Path) -> None:
    loss = Counted()
    x = np.array([-1.0, 0.5])
    results = []
    for _ in range(2):
        with Journal(tmp_path / "run", "a") as journal:
            results.append(journal.wrap(loss)(x))
    assert loss.calls == 1
    (value, slope, aux), (value_again, slope_again, aux_again) = results
    assert value == value_again
    np.testing.assert_array_equal(slope, slope_again)
    np.testing.assert_array_equal(aux, aux_again)
    assert aux_again.shape == (2, 2)


def test_a_failure_read_back_knows_its_place(tmp_path: Path) -> None:
    step, unit = np.array([7, 12])

    def failing(_: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        raise SimulationError("the step failed", step, unit)

    for replayed in (0, 1):
        with (
            Journal(tmp_path / "run", "a") as journal,
            pytest.raises(SimulationError, match="the step failed") as failed,
        ):
            journal.wrap(failing)(np.zeros(2))
        assert (failed.value.step, failed.value.unit, journal.replayed) == (7, 12, replayed)


def test_a_journal_is_for_one_process_within_its_block(tmp_path: Path) -> None:
    with (
        Journal(tmp_path / "run", "a"),
        pytest.raises(JournalInUseError, match="another process"),
        Journal(tmp_path / "run", "a"),
    ):
        pass
    journal = Journal(tmp_path / "run", "a")
    with pytest.raises(RuntimeError, match="with statement"):
        journal.wrap(rosenbrock)(np.zeros(2))
