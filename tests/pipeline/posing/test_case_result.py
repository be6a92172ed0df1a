from pathlib import Path

import numpy as np

from pipeline.posing import scene_of, times_of
from pipeline.posing.case_result import Times
from pipeline.problem import load
from tests.pipeline import static

SERIES = "{ kind: time_series, units: right, file: push.csv }"
SHAKEN = (
    "{ kind: harmonic, units: { units: [[2, 0]] }, amplitude: 1 mm, direction: 0 deg,"
    " frequency: 20 Hz }"
)


def output_times(folder: Path, drive: str, end: float) -> Times:
    """Poses a push that is known up to an end, s, which is the horizon's."""
    path = static.write(folder, static.HOLE, size=5)
    text = path.read_text()
    first, last = text.index("drive:"), text.index("constraints:")
    horizon = f"horizon: {{ duration: {end} s, samples: 5 }}"
    path.write_text(f"{text[:first]}{drive}\n{horizon}\n{text[last:]}")
    rows = f"0,0,0,0\n{end},1,0,0\n"
    (folder / "push.csv").write_text(f"time (s),ux (mm),uy (mm),theta (rad)\n{rows}")
    asked = load(path)
    return times_of(asked, scene_of(asked, folder))


def test_a_response_goes_on_for_some_cycles_and_no_further_than_a_file(tmp_path: Path) -> None:
    steady = output_times(tmp_path, f"drive: {SHAKEN}", 0.1)
    np.testing.assert_allclose(steady.asked[-1], 0.2)
    both = output_times(tmp_path, f"drives:\n  - {SHAKEN}\n  - {SERIES}", 0.1)
    assert both.asked[-1] == both.asked[both.shown][-1] == 0.1


def test_no_time_is_beyond_the_end_of_a_file(tmp_path: Path) -> None:
    end = 0.06666666666666667  # rounded up to whole nanoseconds
    times = output_times(tmp_path, f"drive: {SERIES}", end)
    assert times.asked[-1] == end
    assert len(times.asked) == len(np.unique(times.asked))
