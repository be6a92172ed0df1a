import codecs
from pathlib import Path

import numpy as np
import pytest

from pipeline.tracking.frames import load_cell
from pipeline.tracking.frames.recording import LoadCellLog
from tests.tables import cases, refused

TIME = np.arange(5) / 10


def log(folder: Path, text: str) -> Path:
    path = folder / "load.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_coarse_log_is_read_on_the_clock_of_the_video(tmp_path: Path) -> None:
    path = log(tmp_path, "time,force\n10.0,0.0\n10.2,2.0\n10.3,2.0\n")
    found = load_cell.forces(load_cell.read(path, LoadCellLog(file="load.csv", offset=10.0)), TIME)
    np.testing.assert_allclose(found, [0.0, 1.0, 2.0, 2.0, np.nan])


def test_a_fine_log_is_averaged_over_each_frame(tmp_path: Path) -> None:
    clock = np.arange(0, 0.5, 0.001)
    force = 3.0 + clock + (-1.0) ** np.arange(len(clock))
    rows = "\n".join(f"{t:.3f};{f:.6f}" for t, f in zip(clock, force, strict=True))
    rows = rows.replace(".", ",")
    path = log(tmp_path, f"Machine 7;\nt [s];F [N]\n{rows}\n")
    cell = LoadCellLog(file="load.csv", time="t [s]", force="F [N]")
    found = load_cell.forces(load_cell.read(path, cell), TIME)
    np.testing.assert_allclose(found[1:4], 3.0 + TIME[1:4], atol=0.02)


def test_a_cell_counts_along_the_drive_and_from_the_start_if_asked(tmp_path: Path) -> None:
    path = log(tmp_path, "time,force\n0.0,-8.0\n0.4,-12.0\n")
    cell = LoadCellLog(file="load.csv", reversed=True, zero="start")
    read = load_cell.read(path, cell)
    load_cell.check(read, (0.0, 0.4), path, cell)
    np.testing.assert_allclose(load_cell.forces(read, TIME), 8.0 + 10 * TIME)
    np.testing.assert_allclose(load_cell.forces(read, TIME, 1), 10 * TIME, atol=1e-12)
    late = log(tmp_path, "time,force\n0.2,-8.0\n0.4,-12.0\n")
    with refused("after the first frame", "load_cell.zero"):
        load_cell.check(load_cell.read(late, cell), (0.0, 0.4), late, cell)


def test_the_zero_is_the_mean_over_the_frames_at_rest() -> None:
    noise = np.array([1.0, -1.0, 0.0, 0.5, 0.5])
    found = load_cell.forces(load_cell.ForceLog(TIME, 8.0 + noise), TIME, 3)
    np.testing.assert_allclose(found, noise, atol=1e-12)


@cases("tracking", "text, offset, told")
def test_a_faulty_log_is_refused(tmp_path: Path, text: str, offset: float, told: str) -> None:
    path, cell = log(tmp_path, text), LoadCellLog(file="load.csv", offset=offset)
    with refused(told):
        load_cell.check(load_cell.read(path, cell), (0.0, 0.4), path, cell)


def test_units_of_a_log_are_those_of_its_heading(tmp_path: Path) -> None:
    cell = LoadCellLog(file="load.csv", time="Time", force="Load")
    plain = load_cell.read(log(tmp_path, "Time,Load\n0.1,20\n0.2,40\n"), cell)
    for text in (
        "Time (ms),Load (kN)\n100,0.02\n200,0.04\n",
        "Time,Load\n(ms),(kN)\n100,0.02\n200,0.04\n",
        "Time,Load\nms,kN\n100,0.02\n200,0.04\n",
    ):
        found = load_cell.read(log(tmp_path, text), cell)
        np.testing.assert_allclose(found.clock, plain.clock)
        np.testing.assert_allclose(found.force, plain.force)
    with refused("is not that of a force", "Load"):
        load_cell.read(log(tmp_path, "Time (s),Load (mm)\n0.1,20\n"), cell)
    with refused("unknown unit 'ozf'", "Load", "convert the numbers to N"):
        load_cell.read(log(tmp_path, "Time,Load\ns,ozf\n0.1,20\n"), cell)


@cases("tracking", "time, force")
def test_units_behind_a_name_are_read_as_those_in_brackets(
    tmp_path: Path, time: str, force: str
) -> None:
    path = log(tmp_path, f"{time};{force}\n100;0,02\n200;0,04\n")
    found = load_cell.read(path, LoadCellLog(file="load.csv", time=time, force=force))
    np.testing.assert_allclose(found.clock, [0.1, 0.2])
    np.testing.assert_allclose(found.force, [20.0, 40.0])


@cases("tracking", "force, told")
def test_a_unit_that_is_none_of_a_force_is_refused(tmp_path: Path, force: str, told: str) -> None:
    path = log(tmp_path, f"time;{force}\n0;2\n1;4\n")
    with refused(told, force, f"{force} (N)", path):
        load_cell.read(path, LoadCellLog(file="load.csv", force=force))


@pytest.mark.parametrize("force", ["force_left", "Load cell", "force_min", "Kraft F", "F_t"])
def test_the_end_of_a_name_is_no_unit_unless_it_is_known(tmp_path: Path, force: str) -> None:
    path = log(tmp_path, f"time_s;{force}\n0;2\n1;4\n")
    found = load_cell.read(path, LoadCellLog(file="load.csv", time="time_s", force=force))
    np.testing.assert_array_equal(found.force, [2.0, 4.0])


def test_a_name_before_a_stroke_names_the_column(tmp_path: Path) -> None:
    path = log(tmp_path, "Time / ms;Load / kN\n100;0,02\n200;0,04\n")
    found = load_cell.read(path, LoadCellLog(file="load.csv", time="Time", force="Load"))
    np.testing.assert_allclose(found.force, [20.0, 40.0])


@pytest.mark.parametrize("cell", ["1.004,2", "1 004,2", "OVL", ">1000", "inf", "12,0 N"])
def test_a_force_that_is_no_number_is_refused(tmp_path: Path, cell: str) -> None:
    """Left out, it would be a straight line across the peak of the test."""
    path = log(tmp_path, f"t;F\n0,0;990,5\n0,1;{cell}\n0,2;995,0\n")
    with refused("not a finite number", "F", "marks of thousands", path) as caught:
        load_cell.read(path, LoadCellLog(file="load.csv", time="t", force="F"))
    assert (caught.value.line, caught.value.value) == (3, cell)


@pytest.mark.parametrize("gap", ["", "NaN", "-nan(ind)", "#N/A", "n/a", "-", "null", "1.#QNAN"])
def test_what_was_not_measured_is_a_gap(tmp_path: Path, gap: str) -> None:
    text = f"t;F\nClock;Cell\n0,0;1,5\n0,1;{gap}\n0,2\n\n0,3;2,5\n"
    text += "# zeroed; 5\nMean;2,0\nEnd of test;\n"
    cell = LoadCellLog(file="load.csv", time="t", force="F")
    np.testing.assert_array_equal(load_cell.read(log(tmp_path, text), cell).force, [1.5, 2.5])


@pytest.mark.parametrize(
    ("mark", "encoding"),
    [
        (codecs.BOM_UTF16_LE, "utf-16-le"),
        (codecs.BOM_UTF16_BE, "utf-16-be"),
        (codecs.BOM_UTF8, "utf-8"),
        (b"", "utf-8"),
        (b"", "cp1252"),
    ],
)
def test_a_log_is_read_in_the_encodings_of_spreadsheets(
    tmp_path: Path, mark: bytes, encoding: str
) -> None:
    path = tmp_path / "load.csv"
    text = "Prüfstand 7, 21 °C\r\nZeit\tPrüfkraft [N]\r\n0,1\t1,5\r\n0,2\t2,5\r\n"
    path.write_bytes(mark + text.encode(encoding))
    found = load_cell.read(path, LoadCellLog(file="load.csv", time="Zeit", force="Prüfkraft"))
    np.testing.assert_array_equal(found.force, [1.5, 2.5])
