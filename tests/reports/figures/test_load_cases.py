from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from pipeline import problem
from pipeline.problem import Output
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import LoadRanges, SeveralDrives
from pipeline.problem.sections.drives import RotationDrive
from reports.base import style
from reports.facts import Fact, checks
from reports.facts.measures import first_within
from reports.figures.loading_path import (
    abscissa,
    curves,
    facts,
    figure,
    measured,
    measures,
    monte_carlo,
    snapshot_grid,
    structure_panels,
    tables,
)
from reports.figures.shielding import facts as shielding
from reports.study import StudyResults, evaluation_count
from tests.reports import figure_assertions, recorded_study
from tests.reports.compressed_study import SHIELD, written
from tests.tables import cases, some

FIG4 = Path(__file__).parents[3] / "experiments/fig4/problem.yaml"
PATH = abscissa.Abscissa("displacement", "u", "mm", np.array([0.0, 15.0]), True, None, (0, 1))


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> StudyResults:
    """A study whose second case does three times what its first does."""
    folder: Path = tmp_path_factory.mktemp("two")
    study = written(folder, SHIELD)
    text = (folder / "problem.yaml").read_text(encoding="utf-8")
    (folder / "problem.yaml").write_text(text.replace("[180 deg]", "[180 deg, 90 deg]"))
    asked = problem.load(folder / "problem.yaml")
    for name in ("response", "geometric_response"):
        study.datasets[name] = _with_second_case(study.datasets[name])
    return StudyResults(**{**vars(study), "problem": asked})


def _with_second_case(response: xr.Dataset) -> xr.Dataset:
    more = [
        response[name] * 3 if name in ("displacement", "loss") else response[name]
        for name in response.data_vars
        if "case" in response[name].dims
    ]
    second = xr.merge(more, compat="override").assign_coords(direction=("case", [90.0]))
    second["drive_displacement"] = -second["drive_displacement"].roll(xy=1)
    whole = xr.concat([response, second], "case", data_vars="minimal", coords="minimal")
    return whole.assign_attrs(response.attrs)


def test_each_load_case_has_rows_snapshots_and_a_curve(two: StudyResults) -> None:
    assert abscissa.load_names(two.problem, two.response) == ("compression 180°", "shear 90°")
    path = abscissa.abscissa_of(two.problem, two.response)
    found: dict[str, Fact] = {fact.key: fact for fact in facts.measure_facts(two, path)}
    turns = [found[f"rotation_altered_case{case}"].value for case in (0, 1)]
    assert turns[1] == pytest.approx(3 * turns[0])
    assert found["rotation_altered"].value == pytest.approx(2 * turns[0])
    assert "shear 90°" in found["rotation_altered_case1"].label
    assert found["rotation_altered"].note.endswith("; weighted mean of the load cases")
    assert found["rotation_altered_case1"].note == "one load case"
    once_most, most = (
        float(measures.rotation(two.response).sel(structure="cloaked")[case].max())
        for case in (0, 1)
    )
    assert most == pytest.approx(3 * once_most)
    assert found["rotation_cloaked_most"].value == pytest.approx(most)  # not of the mean
    assert found["rotation_cloaked_most"].note == "the largest on the whole path of any load case"
    assert found["rotation_reduction_least"].note.endswith("weighted mean of the load cases")
    assert found["rotation_reduction_least"].unit == "%"
    several = [*facts.reaction_facts(two, path), *facts.contraction_facts(two, path)]
    told = [fact.note for fact in several if "_case" not in fact.key]
    assert told
    assert all(note.endswith("weighted mean of the load cases") for note in told)
    columns = tables.path(two)
    names = ("altered_rotation_deg_compression_180deg", "altered_rotation_deg_shear_90deg")
    first, second = (np.asarray(columns[name]) for name in names)
    np.testing.assert_allclose(second, 3 * first)
    shown = snapshot_grid.rows(two)
    assert [row.case for row in shown][:4] == [0, 1, 0, 1]
    assert len({row.label for row in shown[:4]}) == 4
    made = Figure()
    curves.measure_panel(made.add_subplot(), two, path, measures.measure_of(two.problem))
    drawn = {line.get_label(): line for line in made.axes[0].get_lines()}
    one, other = (drawn[f"Cloaked, {name}"] for name in ("compression 180°", "shear 90°"))
    assert (one.get_color(), one.get_linestyle()) != (other.get_color(), other.get_linestyle())
    once, thrice = (np.asarray(line.get_ydata(), dtype=float) for line in (one, other))
    np.testing.assert_allclose(thrice, 3 * once)


def test_snapshots_of_many_recordings_are_told_apart(two: StudyResults, tmp_path: Path) -> None:
    """Each by its structure and load, in labels that do not run into the next one's."""
    shown = (("altered", 0), ("cloaked", 0), ("cloaked", 1))
    filmed = recorded_study.with_recordings(two, tmp_path, *shown)
    path = abscissa.abscissa_of(filmed.problem, filmed.response)
    grid = snapshot_grid.SnapshotLayout.of(filmed, path, 100.0)
    assert len({row.label for row in grid.rows}) == len(grid.rows)
    made = style.page(200.0)
    snapshot_grid.snapshots(made, filmed, grid, grid.head)
    made.draw_without_rendering()
    boxes = [text.get_window_extent() for text in made.texts if text.get_text()]
    assert all(box.x0 >= 0.0 and box.y1 <= made.bbox.y1 for box in boxes)
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


@pytest.mark.parametrize("filmed", some([[], ["altered", "cloaked"], ["cloaked"]]))
def test_snapshots_of_many_loads_are_wrapped(
    two: StudyResults, tmp_path: Path, filmed: list[str]
) -> None:
    """In a single row those of four loads, and as many recordings, were as wide as a letter."""
    many = in_many(two, 4)
    shown = [(name, case) for name in filmed for case in range(4)]
    study = recorded_study.with_recordings(many, tmp_path, *shown)
    path = abscissa.abscissa_of(study.problem, study.response)
    grid = snapshot_grid.SnapshotLayout.of(study, path, figure.TALLEST_SNAPSHOTS - 10.0)
    assert min(grid.width, grid.height) >= 12.0
    places = {grid.at(k, m) for k in range(len(grid.rows)) for m in range(len(grid.path.shown))}
    assert len(places) == len(grid.rows) * len(grid.path.shown)
    assert grid.head - 8.5 + grid.total <= figure.TALLEST_SNAPSHOTS - 10.0 + 1e-9
    with style.styled():
        made = figure.loading_path_figure(study)
        figure_assertions.assert_legible(figure_assertions.drawn(made.draw()))
    left_out = len(grid.path.shown) < len(path.shown)
    assert ("instants of the snapshots" in made.caption) == left_out
    assert grid.path.shown[-1] == path.shown[-1]


def test_a_snapshot_beyond_the_end_of_a_recording_is_told(
    two: StudyResults, tmp_path: Path
) -> None:
    """It showed the structure at rest, as if nothing had moved under the load."""
    filmed = recorded_study.with_recordings(two, tmp_path, ("cloaked", 0))
    name, data = next(iter(filmed.compared.items()))
    study = replace(filmed, compared={name: data.isel(time=slice(0, 4))})
    path = abscissa.abscissa_of(study.problem, study.response)
    shown = [row for row in snapshot_grid.rows(study) if "experiment" in row.label]
    shade = structure_panels.shade_of(study.problem, study.response)
    for sample, is_recorded in ((0, True), (path.shown[-1], False)):
        axes = Figure().add_subplot()
        snapshot_grid.snapshot(axes, study.problem, shown[0].part, sample, shade)
        assert bool(axes.collections) == is_recorded
        assert [text.get_text() for text in axes.texts] == ["not\nrecorded"] * (not is_recorded)


def test_the_legend_is_above_curves_on_both_sides_of_zero(
    two: StudyResults, tmp_path: Path
) -> None:
    turned = two.response.copy(deep=True)
    turned["displacement"][:, 1] *= -1.0
    datasets = two.datasets | {"response": turned}
    study = recorded_study.with_recordings(
        replace(two, datasets=datasets), tmp_path, ("cloaked", 0)
    )
    path = abscissa.abscissa_of(study.problem, study.response)
    with style.styled():
        made = style.page(60.0)
        axes = style.place(made, 20.0, 10.0, 30.0, 27.0)
        curves.contraction_panel(axes, study, path)
        made.draw_without_rendering()
    legend = axes.get_legend()
    assert legend is not None
    drawn = [np.asarray(line.get_ydata(), dtype=float) for line in axes.get_lines()]
    most = max(float(np.nanmax(curve)) for curve in drawn)
    least = min(float(np.nanmin(curve)) for curve in drawn)
    assert least < -0.5 * most
    top = float(axes.transData.transform((0.0, most))[1])
    assert top <= legend.get_window_extent().y0


def test_snapshots_hold_a_structure_that_is_pulled(smile: StudyResults) -> None:
    """Those of one that is pressed have the scale that they had."""
    pulled = smile.response.assign(displacement=-smile.response["displacement"])
    widths = []
    for response in (smile.response, pulled):
        study = replace(smile, datasets={"design": smile.design, "response": response})
        path = abscissa.abscissa_of(study.problem, study.response)
        grid = snapshot_grid.SnapshotLayout.of(study, path, 100.0)
        snapshot_grid.snapshots(made := style.page(200.0), study, grid, grid.head)
        *drawn, _ = made.axes
        widths.append({float(np.ptp(axes.get_xlim())) for axes in drawn})
        for axes in drawn:
            (units,) = axes.collections
            points = np.concatenate([path.vertices for path in units.get_paths()])
            box = axes.viewLim
            assert box.x0 <= points[:, 0].min() < points[:, 0].max() <= box.x1
            assert box.y0 <= points[:, 1].min() < points[:, 1].max() <= box.y1
    (pressed,), (of_pulled,) = widths
    assert of_pulled > pressed + 15.0


@pytest.mark.parametrize(
    ("columns", "rows", "wide"), [(15, 15, False), (40, 10, True), (10, 40, False)]
)
def test_snapshots_of_a_long_lattice_are_as_long(
    smile: StudyResults, columns: int, rows: int, wide: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In squares they would be small, and most of the page white."""
    size = {"columns": columns, "rows": rows}
    lattice = smile.problem.lattice.model_copy(update=size)
    posed = replace(smile, problem=smile.problem.model_copy(update={"lattice": lattice}))
    path = abscissa.abscissa_of(smile.problem, smile.response)
    drawn = snapshot_grid.rows(smile)
    monkeypatch.setattr(snapshot_grid, "rows", lambda _: drawn)
    grid = snapshot_grid.SnapshotLayout.of(posed, path, 80.0)
    assert (grid.width > grid.height) == wide
    assert (grid.width == grid.height) == (columns == rows)
    assert grid.lines * grid.height <= 80.0 + 1e-9
    square = snapshot_grid.SnapshotLayout.of(smile, path, 80.0)
    assert max(grid.width, grid.height) > 0.9 * square.width


@cases("reports", "degrees, labels")
def test_a_drive_of_the_right_edge_is_named(degrees: tuple[float, ...], labels: list[str]) -> None:
    """The kind of strain, by the direction of the drive and its side."""
    asked = problem.load(FIG4)
    drive = asked.drive.model_copy(update={"directions": tuple(np.radians(degrees))})
    found = list(facts.strain_facts(asked.model_copy(update={"drive": drive}), PATH))
    assert [fact.label for fact in found] == labels
    assert [fact.value for fact in found] == pytest.approx([100 * 15.0 / 210.0] * len(found))


def test_two_sides_that_are_pressed_have_no_strain_by_one() -> None:
    asked = problem.load(FIG4)
    other = asked.drive.model_copy(update={"units": "left", "directions": (0.0,)})
    both = SeveralDrives.model_construct(kind="several", drives=(asked.drive, other))
    assert not list(facts.strain_facts(asked.model_copy(update={"drive": both}), PATH))


def test_a_drive_of_inner_units_strains_no_lattice() -> None:
    asked = problem.load(FIG4)
    inner = asked.drive.model_copy(update={"units": "centre", "directions": (0.0, np.pi / 2)})
    pushed = asked.model_copy(update={"drive": inner})
    assert not list(facts.strain_facts(pushed, PATH))
    assert [abscissa.load_kind(pushed, angle) for angle in (0.0, 90.0)] == ["along", "along"]


@pytest.mark.parametrize("count", [2, 4])
def test_a_legend_of_several_loads_is_below_all_curves(two: StudyResults, count: int) -> None:
    """It names every curve once, and leaves to a panel what is in that one alone."""
    with style.styled():
        made = figure_assertions.drawn(figure.loading_path_figure(in_many(two, count)).draw())
    figure_assertions.assert_legible(made)
    (legend,) = made.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert len(set(names)) == len(names) == 2 * count
    below = min(box.y0 for axes in made.axes if (box := axes.get_tightbbox()) is not None)
    assert 0.0 <= legend.get_window_extent().y0 < legend.get_window_extent().y1 <= below
    axes = next(axes for axes in made.axes if axes.get_ylabel().startswith("Mean"))
    own = axes.get_legend()
    assert own is not None
    kept = {text.get_text() for text in own.get_texts()}
    assert "Unloaded: zero" in kept
    assert not kept & set(names)


def test_what_is_not_drawn_by_load_case_is_told(two: StudyResults, shield: StudyResults) -> None:
    scatter = shield.scatter
    assert scatter is not None
    departure = xr.concat([scatter["departure"]] * 2, "case")
    datasets = two.datasets | {
        "scatter": scatter.drop_vars("departure").assign(departure=departure)
    }
    told = figure.loading_path_figure(replace(two, datasets=datasets)).caption
    mean = " (weighted mean over the load cases)"
    assert f"hold 90 % of the imperfect cloaks{mean}, each of one kind" in told
    assert f"at the end of the path{mean} over imperfect cloaks" in told
    assert "drive, the least of all load cases: where it vanishes" in told
    assert "along the arrows (each direction a load case)" in told
    assert "Loss against evaluation, thin that of each load case; rejected" in told
    alone = figure.loading_path_figure(shield).caption
    assert not any(words in alone for words in (mean, "the least of all", "each direction", "thin"))


def test_the_eigenvalue_vanishes_where_that_of_one_case_does(two: StudyResults) -> None:
    response = two.response.copy(deep=True)
    response["eigenvalue"][:, 1, -1] = 0.0
    study = replace(two, datasets=two.datasets | {"response": response})
    axes = (made := Figure()).add_subplot()
    curves.drive_panel(axes, study, abscissa.abscissa_of(study.problem, response))
    ends = [np.asarray(line.get_ydata(), dtype=float)[-1] for line in made.axes[1].lines]
    assert ends == [0.0, 0.0]


def in_many(study: StudyResults, count: int) -> StudyResults:
    """The study of two loads with so many of them, each pair the same again."""
    asked, response = study.problem, study.response
    more = xr.concat([response] * (count // 2), "case", data_vars="minimal", coords="minimal")
    ways = tuple(np.radians(more["direction"].values))
    drive = asked.drive.model_copy(update={"directions": ways, "weights": None})
    datasets: dict[Output, xr.Dataset] = {
        "design": study.design,
        "response": more.assign_attrs(response.attrs),
    }
    posed = asked.model_copy(update={"drive": drive})
    return replace(study, problem=posed, datasets=datasets)


def test_curves_of_many_cases_stay_on_their_panel(two: StudyResults) -> None:
    """However long the legend is: of ten entries none was left for them."""
    many = in_many(two, 6)
    path = abscissa.abscissa_of(many.problem, many.response)
    made = Figure()
    curves.measure_panel(made.add_subplot(), many, path, measures.measure_of(many.problem))
    low, high = made.axes[0].get_ylim()
    drawn = [np.asarray(line.get_ydata(), dtype=float) for line in made.axes[0].get_lines()]
    most = max(float(np.nanmax(curve)) for curve in drawn if curve.size)
    assert low <= 0.0 < most < high


def test_numbers_of_a_low_bar_of_colours_do_not_overlap(two: StudyResults) -> None:
    """Beside a single row of snapshots that are small."""
    shade = structure_panels.shade_of(two.problem, two.response)
    with style.styled():
        snapshot_grid.shade_bar(made := style.page(60.0), shade, (150.0, 10.0, 17.0))
        figure_assertions.assert_legible(figure_assertions.drawn(made))


def test_equal_loads_are_numbered_and_a_clockwise_turn_ascends(
    two: StudyResults, study: StudyResults
) -> None:
    alike = two.response.assign_coords(direction=("case", [180.0, 180.0]))
    names = abscissa.load_names(two.problem, alike)
    assert names == ("load 1, compression 180°", "load 2, compression 180°")
    shaken = two.problem.model_copy(update={"drive": study.problem.drive})
    assert abscissa.load_names(shaken, two.response) == ("along 180°", "along 90°")
    assert abscissa.load_names(shaken, alike)[1] == "load 2, along 180°"
    unknown = two.response.assign_coords(direction=("case", [np.nan, np.nan]))
    assert abscissa.load_names(shaken, unknown) == ("load 1", "load 2")
    turn = RotationDrive.model_validate(
        {"kind": "rotation", "units": "right", "amplitude": -0.2}, context=SIM_UNITS
    )
    response = two.response.assign_coords(amplitude=("case", [-0.2, -0.2]))
    path = abscissa.abscissa_of(two.problem.model_copy(update={"drive": turn}), response)
    assert path.name == "Applied rotation, clockwise"
    assert path.values[-1] == pytest.approx(np.degrees(0.2))


def test_failed_evaluations_count(two: StudyResults) -> None:
    history = two.design.isel(method=0).isel(evaluation=[0] * 7)
    history["loss"] = ("evaluation", [1.0, np.nan, np.nan, 0.9, 0.5, 0.1, np.nan])
    history["violation"] = ("evaluation", [0.0] * 6 + [np.nan])
    assert evaluation_count(history) == 6
    assert first_within(history["loss"].values, 0.1, 0.9) == 5


@pytest.mark.parametrize("ranges", [None, LoadRanges()])
def test_losses_under_loads_in_ranges_are_not_called_the_worst(
    two: StudyResults, study: StudyResults, ranges: LoadRanges | None
) -> None:
    for results, told in ((two, checks.history_facts), (study, shielding.history_facts)):
        objective = results.problem.objective.model_copy(update={"loads": ranges})
        asked = results.problem.model_copy(update={"objective": objective})
        found = {fact.key: fact.note for fact in told(asked, results.design)}
        assert ("of the way" in found["evaluations_sqp"]) == (ranges is None)
        assert found["evaluations_sqp"].startswith("best feasible after")
        assert ("not the worst of all" in found["best_sqp"]) == (ranges is not None)


def test_recordings_are_compared_under_their_own_load_case(
    two: StudyResults, tmp_path: Path
) -> None:
    shown = (("altered", 0), ("altered", 1), ("cloaked", 1))
    filmed = recorded_study.with_recordings(two, tmp_path, *shown)
    path = abscissa.abscissa_of(two.problem, two.response)
    found = {fact.key: fact.value for fact in measured.measured_facts(filmed, path)}
    first, second = (found[f"measured_rotation_altered_case{case}"] for case in (0, 1))
    assert second == pytest.approx(3 * first)
    gain = found["measured_rotation_reduction_case1"]
    assert gain == pytest.approx(100 * (1 - found["measured_rotation_cloaked_case1"] / second))
    assert "measured_rotation_reduction_case0" not in found


def test_copies_are_measured_in_the_size_of_each_load_case(two: StudyResults) -> None:
    mimic = measures.Measure("mismatch", "", "", "1", lambda made: made["loss"])
    named = [*two.response["structure"].values[:-1], "intact"]
    response = two.response.assign_coords(structure=named)
    sizes = measures.size_of_intact(response, measures.scales(two.problem))
    assert sizes[1] == pytest.approx(3 * float(sizes[0]))
    copies = xr.Dataset({"departure": (("case", "time"), [[0.1], [0.3]])})
    found = monte_carlo.copy_curves(two.problem, mimic, response, copies)
    np.testing.assert_allclose(found, 0.1 / sizes[0])
