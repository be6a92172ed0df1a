import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
import yaml
from pydantic import ValidationError

from pipeline import datasets
from pipeline.calibration import load_cycle_study, study_cycles
from pipeline.calibration.experiments import force_displacement, load_cycles
from pipeline.calibration.inputs import ForceDisplacement, LoadCycles, RecordOptions, SampleTest
from pipeline.calibration.load_cycle_study import follow_cycle, measure_cycle
from pipeline.problem.fields import SIM_UNITS, csv_columns
from pipeline.problem.reading import load_section, overlay_keys
from pipeline.problem.sections import Lattice as Specimen
from pipeline.problem.sections import ListedNetwork
from pipeline.runtime import ROOT, UserError
from sim.energy import observe
from sim.quasistatics import EquilibriumTrace, StaticRecord, StaticSolver, trace, trace_first_snap
from sim.solvers import PrescribedMotion
from sim.structure import ConcreteParameters
from tests.pipeline.calibration.specimens import LATTICE
from tests.tables import refused, some

FOLDER = ROOT / "experiments/validation"
INSTRON = FOLDER.parents[1] / "tests/data/calibration/instron.csv"


def cycles(count: int = 3, slack: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Goes to 2 mm and back, at 3 N/mm and 2 N/mm, the first cycle 10 % stiffer, after a slack."""
    way = np.concatenate([np.linspace(0, 2, 41), np.linspace(2, 0, 41)[1:]] * count)
    rises = np.tile(np.r_[np.ones(41, bool), np.zeros(40, bool)], count)
    stiff = np.where(rises, 3.0, 2.0)
    stiff[:81] *= 1.1
    return way, stiff * np.maximum(way - slack, 0.0)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"contact": {"law": "geometric"}}, "contact by the law of distance is not known here"),
        ({"material": None}, "contact is of the simulation, and there is none without material"),
        ({"material": None, "contact": None}, "known is of the simulation"),
    ],
)
def test_what_no_simulation_takes_is_refused(
    changed: dict[str, Any], told: str, tmp_path: Path
) -> None:
    data = yaml.safe_load((FOLDER / "morpher.yaml").read_text())
    for section in (data["lattice"], data["drive"]):
        section["file"] = str(FOLDER / section["file"])
    (tmp_path / "morpher.yaml").write_text(yaml.safe_dump(data))
    load_section(tmp_path / "morpher.yaml", LoadCycles)
    data["records"][0] = overlay_keys(data["records"][0], changed)
    (tmp_path / "morpher.yaml").write_text(yaml.safe_dump(data))
    with refused(told):
        load_section(tmp_path / "morpher.yaml", LoadCycles)


@pytest.mark.parametrize(
    ("changed", "key", "told"),
    [
        ({"held": 280}, "drive.held", "no unit 280: the lattice has 64, numbered from 0"),
        ({"driven": 64}, "drive.driven", "no unit 64: the lattice has 64, numbered from 0"),
        ({"held": 35}, "drive.driven", "the unit that moves is held"),
    ],
)
def test_a_drive_of_units_that_are_not_there_is_refused(
    changed: dict[str, int], key: str, told: str, tmp_path: Path
) -> None:
    data = yaml.safe_load((FOLDER / "morpher.yaml").read_text())
    data["lattice"]["file"] = str(FOLDER / data["lattice"]["file"])
    data["drive"] |= changed
    path = tmp_path / "morpher.yaml"
    path.write_text(yaml.safe_dump(data))
    with refused(told, key, file=path):
        load_section(path, LoadCycles)


def test_branches_and_loops_of_a_record() -> None:
    branches = load_cycles.split_branches(*cycles())
    assert [each.loading for each in branches] == [True, False] * 3
    np.testing.assert_allclose(branches[2].work, 6.0, rtol=0.02)
    np.testing.assert_allclose(load_cycles.loop_areas(branches)[2::2], 2.0, rtol=0.05)
    way, force = cycles(2)
    shaken = way + np.random.default_rng(0).normal(0, 0.02, len(way))
    assert len(load_cycles.split_branches(shaken, force)) == 4


@pytest.mark.parametrize(("branch", "stiffness"), [("loading", 3.0), ("unloading", 2.0)])
def test_a_record_is_cut_as_wanted(branch: str, stiffness: float) -> None:
    options = RecordOptions(branch=branch, drop_first=True)  # type: ignore[arg-type]
    way, force = load_cycles.prepare_record(*cycles(), options)
    inner = (way > 0.1) & (way < 1.9)  # a turn belongs to both branches
    np.testing.assert_allclose(force[inner], stiffness * way[inner], rtol=1e-9)


@pytest.mark.parametrize("toe", ["0.6 N", "0.07 N"])  # of which twice is between the same lines
def test_slack_is_taken_up_by_the_toe(toe: str) -> None:
    options = RecordOptions.model_validate({"drop_first": True, "toe": toe})
    way, force = load_cycles.prepare_record(*cycles(slack=0.3), options)
    np.testing.assert_allclose(force, 3.0 * way, atol=1e-9)


@pytest.mark.parametrize(
    ("toe", "told"), [("4 N", "does not rise to 8"), ("0.2 N", "begins above")]
)
def test_a_toe_that_a_branch_does_not_show_is_refused(toe: str, told: str) -> None:
    options = RecordOptions.model_validate({"toe": toe})
    with pytest.raises(ValueError, match=told):
        load_cycles.prepare_record(cycles()[0], cycles()[1] + 0.3, options)


def noisy(noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Loads to 5 mm at 0.6 N/mm, with a slack of 1 mm and offsets of both zeros."""
    way = np.linspace(0, 5, 400)
    scatter = np.random.default_rng(1).normal(0, noise, len(way))
    return way + 0.7, 0.6 * np.maximum(way - 1.0, 0.0) - 0.2 + scatter


@pytest.mark.parametrize("noise", [0.01, 0.02])
def test_noise_biases_neither_zero_nor_contact(noise: float) -> None:
    options = RecordOptions.model_validate({"zero": "start", "toe": "0.1 N"})
    way, force = load_cycles.prepare_record(*noisy(noise), options)
    assert np.median(way - force / 0.6) == pytest.approx(0.0, abs=0.1)
    assert way @ force / (way @ way) == pytest.approx(0.6, rel=0.05)


def test_a_toe_within_the_noise_is_refused() -> None:
    options = RecordOptions.model_validate({"zero": "start", "toe": "0.1 N"})
    with pytest.raises(ValueError, match=r"not clear of the force's noise .* give 0.1\d N or more"):
        load_cycles.prepare_record(*noisy(0.04), options)


def test_a_force_that_rises_at_rest_is_no_contact() -> None:
    way, force = np.repeat([0.0, 1.0, 2.0], 40), np.arange(120) / 120
    options = RecordOptions.model_validate({"toe": "0.1 N"})
    with pytest.raises(ValueError, match="N without motion"):
        load_cycles.prepare_record(way, force, options)


@pytest.mark.parametrize(("reversed_", "signs"), [("both", (-1, -1)), ("force", (1, -1))])
def test_what_a_machine_counts_backwards_is_turned(reversed_: str, signs: tuple[int, int]) -> None:
    way, force = cycles()
    wanted = load_cycles.prepare_record(way, force, RecordOptions())
    options = RecordOptions.model_validate({"reversed": reversed_})
    found = load_cycles.prepare_record(signs[0] * way, signs[1] * force, options)
    np.testing.assert_array_equal(found, wanted)


def test_zeros_of_the_machine_are_taken_from_the_start() -> None:
    way, force = cycles(2)
    options = RecordOptions(zero="start", drop_first=True)
    found = load_cycles.prepare_record(way + 0.7, force - 0.2, options)
    np.testing.assert_allclose(found[1], 3.0 * found[0], atol=1e-9)


def test_a_machines_file_is_read_with_its_units_below_the_names() -> None:
    record = {"drop_first": True, "zero": "start"}
    asked = {"columns": {"displacement": "Extension", "force": "Load"}, "record": record}
    way, force = read(asked_of(INSTRON.name, **asked), INSTRON.parent)
    np.testing.assert_allclose(force, 3.0 * way, atol=1e-3)


def asked_of(file: str, **more: object) -> ForceDisplacement:
    given = {"kind": "force_displacement", "name": "c", "test": "compression", "lattice": LATTICE}
    return ForceDisplacement.model_validate(given | {"file": file} | more)


def read(asked: ForceDisplacement, folder: Path, **more: bool) -> tuple[np.ndarray, np.ndarray]:
    return force_displacement.read(asked, asked.lattice, folder, **more)


def test_a_test_in_the_other_direction_is_refused(tmp_path: Path) -> None:
    lines = "\n".join(f"{-k},{-2 * k}" for k in range(20))
    (tmp_path / "one.csv").write_text(f"displacement (mm),force (N)\n{lines}\n")
    with refused("nowhere above zero", "displacement", "reversed: both"):
        read(asked_of("one.csv"), tmp_path)
    record = {"record": {"reversed": "both"}}
    way, force = read(asked_of("one.csv", **record), tmp_path)
    np.testing.assert_array_equal([way, force], [np.arange(20), 2 * np.arange(20)])


@pytest.mark.parametrize("tare", [False, True])
def test_a_force_against_the_test_is_refused(tare: bool, tmp_path: Path) -> None:
    lines = "\n".join(f"{k},{tare * 90 - 2 * k}" for k in range(20))
    (tmp_path / "one.csv").write_text(f"displacement (mm),force (N)\n{lines}\n")
    with refused("not above zero", "force", "reversed: force", file=tmp_path / "one.csv"):
        read(asked_of("one.csv"), tmp_path, tare=tare)
    turned = asked_of("one.csv", record={"reversed": "force"})
    _, force = read(turned, tmp_path, tare=tare)
    assert force[-1] > force[0]


def test_an_offset_of_the_load_cell_is_no_force_against_the_test(tmp_path: Path) -> None:
    lines = "\n".join(f"{k},{2 * k - 90}" for k in range(20))
    (tmp_path / "one.csv").write_text(f"displacement (mm),force (N)\n{lines}\n")
    _, force = read(asked_of("one.csv"), tmp_path, tare=True)
    np.testing.assert_array_equal(force, 2 * np.arange(20) - 90)
    with refused("not above zero", "force", "zero: start"):
        read(asked_of("one.csv"), tmp_path)


@pytest.mark.parametrize("turned", ["displacement", "both"])
def test_the_displacement_of_a_track_is_not_turned(turned: str) -> None:
    with pytest.raises(ValidationError, match="counts in the test's direction"):
        asked_of("run.nc", record={"reversed": turned})
    with pytest.raises(ValidationError, match="counts in the test's direction"):
        SampleTest.model_validate(
            {"test": "shear", "samples": ["s1"], "file": "run.nc", "record": {"reversed": turned}}
        )
    asked_of("run.nc", record={"reversed": "force"})
    asked_of("run.csv", record={"reversed": turned})


def track_of(
    way: np.ndarray, top: slice, bottom: slice, specimen: Specimen | None = None
) -> xr.Dataset:
    """A track of a squeezed specimen whose fixture gives way, and whose top grip is askew."""
    motion = np.zeros((len(way), 12, 3))
    motion[:, :, 1] = 0.1 * way[:, None]
    motion[:, top, 1] -= way[:, None] * [0.9, 1.0, 1.1]
    motion[3, top.stop - 1] = np.nan
    motion[4, bottom.start] = np.nan
    lattice = (specimen or asked_of("run.nc").lattice).network()
    coordinates = {"dof": ["ux", "uy", "theta"], "j": ("unit", np.repeat(range(4), 3))}
    variables = {
        "displacement": (("time", "unit", "dof"), motion),
        "load_force": ("time", 3 * way),
        "vertices": (("unit", "vertex", "xy"), lattice.padded(lattice.vertices + 3.0)),
        "timing": ("time", np.zeros(len(way), np.int8)),
    }
    return xr.Dataset(variables, coordinates)


def test_a_track_with_a_load_cell_is_a_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """The way is that from the bottom row, which gives way with the machine; units may be lost."""
    way = np.linspace(0, 2, 9)
    track = track_of(way, slice(9, 12), slice(0, 3))
    monkeypatch.setattr(datasets, "read", lambda *_: track)
    found = read(asked_of("run.nc"), FOLDER)
    np.testing.assert_allclose(found, [way, 3 * way], atol=1e-6)
    track["timing"][5] = 1
    assert len(read(asked_of("run.nc"), FOLDER)[0]) == len(way) - 1
    with refused("of 12 units, the lattice of 9", "unit"):
        read(asked_of("run.nc", lattice=LATTICE | {"rows": 3}), FOLDER)
    for key, value in {"spacing": "12 mm", "bias_angle": "20 deg"}.items():
        with refused("of another specimen", "vertices", "opposite way", file=FOLDER / "run.nc"):
            read(asked_of("run.nc", lattice=LATTICE | {key: value}), FOLDER)
    with refused("of another specimen", "vertices"):
        read(asked_of("run.nc", lattice=LATTICE | {"columns": 4, "rows": 3}), FOLDER)
    track["load_force"][:] = np.nan
    with pytest.raises(UserError, match="no forces"):
        read(asked_of("run.nc"), FOLDER)


def test_rows_of_a_listed_lattice_go_by_their_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its units all have j = 0; here the first ones are at the top."""
    places = [(15.0 * i, 15.0 * j) for j in (3, 1, 2, 0) for i in range(3)]
    arms = [(6.0, 0.0), (0.0, 6.0), (-6.0, 0.0), (0.0, -6.0)]
    listed = ListedNetwork.model_validate(
        {
            "kind": "file",
            "file": "listed.csv",
            "spacing": 15.0,
            "polygons": [[(x + a, y + b) for a, b in arms] for x, y in places],
            "ligaments": [((x, y + 6.0), (x, y + 9.0)) for x, y in places if y < 45.0],
        },
        context=SIM_UNITS,
    )
    way = np.linspace(0, 2, 9)
    track = track_of(way, slice(0, 3), slice(9, 12), listed).assign_coords(
        j=("unit", np.zeros(12, int))
    )
    monkeypatch.setattr(datasets, "read", lambda *_: track)
    found = force_displacement.read(asked_of("run.nc"), listed, FOLDER)
    np.testing.assert_allclose(found, [way, 3 * way], atol=1e-6)


def test_a_record_without_the_branch_is_refused(tmp_path: Path) -> None:
    lines = "\n".join(f"{k},{k}" for k in range(1, 20))
    (tmp_path / "one.csv").write_text(f"displacement (mm),force (N)\n{lines}\n")
    record = {"branch": "unloading"}
    with refused("no such branch", "record", file=tmp_path / "one.csv"):
        read(asked_of("one.csv", record=record), tmp_path)


@pytest.fixture(scope="module")
def morpher() -> LoadCycles:
    return load_section(FOLDER / "morpher.yaml", LoadCycles)


def test_snaps_and_loops_of_the_morpher(morpher: LoadCycles) -> None:
    """By the table that came with the files, which was made by other code."""
    seen = measure_cycle(morpher.records[0], FOLDER)
    (nearing,), (parting,) = seen.snaps
    np.testing.assert_allclose(nearing, (4.381, -6.683, 5.047, -0.07), atol=0.06)
    np.testing.assert_allclose(parting, (1.85, 6.72, 1.32, -0.01), atol=0.06)
    np.testing.assert_allclose((seen.loops[0], seen.loops[-1]), (47.47, 42.95), rtol=0.01)
    assert measure_cycle(morpher.records[1], FOLDER).snaps == ([], [])


@pytest.mark.parametrize(("number", "jumps"), some([(0, (0, 0)), (1, (8, 4))], 1))
def test_equilibria_along_the_arc(morpher: LoadCycles, number: int, jumps: tuple[int, int]) -> None:
    """Within 1 % of each that came with the files, found as they were, and in seconds of one core.

    They are differences of the energy over two steps, which take in what a jump loses: that of L2
    at 8 mm is 3.7 % below the force itself. Half of L2's jumps are at no limit point.
    """
    record = morpher.records[number]
    follow_cycle(morpher, record, FOLDER)  # compiled
    start = time.process_time()
    found = follow_cycle(morpher, record, FOLDER)
    assert time.process_time() - start < 20.0  # for slow machines, too
    assert (found.jumps, found.reversals) == jumps
    assert record.known is not None
    known = csv_columns.read_quantities(FOLDER / record.known, load_cycle_study.KNOWN)
    slope, force = found.compare(known[:, :2]).T
    np.testing.assert_allclose(slope, known[:, 1], rtol=0.01)
    np.testing.assert_allclose(force[:4], slope[:4], atol=0.003 * np.abs(known[:, 1]).max())


@pytest.mark.slow
def test_jumps_leave_a_turning_path(morpher: LoadCycles, monkeypatch: pytest.MonkeyPatch) -> None:
    """It turns where the first and the last jumps begin; stable parts are as solved.

    Where a ligament has turned by half a turn, the path ends.
    """
    made = []

    def kept(
        solver: StaticSolver, values: ConcreteParameters, drive: PrescribedMotion,
        record: StaticRecord,
    ) -> EquilibriumTrace | None:  # fmt: skip
        path = trace_first_snap(solver, values, drive, record)
        if path is not None:
            made.append((record.topology or solver.topology, values, drive, path))
        return path

    monkeypatch.setattr(load_cycle_study, "trace_first_snap", kept)
    found = follow_cycle(morpher, morpher.records[1], FOLDER)
    ((fixed, values, drive, path),) = made
    first, second, third, fourth = path.turns
    assert (path.n_negative[first + 1 : second] == 1).all()
    assert not path.n_negative[second + 1 : third].any()
    assert (path.n_negative[third + 1 : fourth] == 1).all()
    assert (np.diff(found.traced[first : second + 1, 0]) < 0).all()
    assert (np.diff(found.traced[third : fourth + 1, 0]) < 0).all()
    near, far = path.loads[1:first], 240 - path.loads[fourth + 1 :][::-1]
    loads = np.unique(np.concatenate([np.arange(1.0, 240), near, far]))
    solved = StaticSolver(fixed, loads).forward(values, drive)[2]
    limits = [*solved.snaps[:2], *(240 - solved.snaps[:-3:-1])]
    np.testing.assert_allclose(path.loads[[first, third, second, fourth]], limits, atol=1e-6)
    for at, ours in ((near, path.states[1:first]), (far, path.states[fourth + 1 :][::-1])):
        assert len(at) > 3
        pair = np.stack([ours, solved.states[np.searchsorted(loads, at)]])
        force = observe(fixed, values, pair.reshape(-1, 64, 3)).force_on(np.array([35]))
        np.testing.assert_allclose(force[: len(at)], force[len(at) :], rtol=0, atol=1e-6)
    before = 110.0, solved.states[np.searchsorted(loads, 110.0)]
    ended = trace(fixed, values, drive, before, 120.0)
    assert ended.loads[-1] == pytest.approx(solved.snaps[2], abs=1e-5)
    assert not len(ended.turns)


def test_play_opens_a_gap_without_force(morpher: LoadCycles) -> None:
    found = follow_cycle(morpher, morpher.records[0], FOLDER)
    moved = found.with_play(0.4)
    np.testing.assert_allclose(np.abs(moved.approach - found.approach), 0.2)
    assert (np.sign(moved.approach - found.approach) == -np.sign(found.tension)).all()


def test_paths_back_and_lone_branches_are_refused(morpher: LoadCycles, tmp_path: Path) -> None:
    path = ["ux (mm),uy (mm),approach (mm)", "0,0,0", "1,0,1", "2,0,0.5", "3,0,2"]
    (tmp_path / "arc.csv").write_text("\n".join(path))
    drive = morpher.drive.model_copy(update={"file": "arc.csv"})
    wrong = morpher.model_copy(update={"drive": drive})
    with refused("the approach does not rise", "approach"):
        follow_cycle(wrong, morpher.records[0], tmp_path)
    lines = "\n".join(f"{k},{k}" for k in range(1, 30))
    (tmp_path / "one.csv").write_text(f"approach (mm),tension (N)\n{lines}\n")
    single = morpher.records[2].model_copy(update={"file": "one.csv"})
    with refused("no whole cycle", file=tmp_path / "one.csv"):
        study_cycles(morpher.model_copy(update={"records": (single,)}), tmp_path)
