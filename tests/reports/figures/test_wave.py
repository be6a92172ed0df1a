from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from pipeline import problem
from pipeline.posing import law_comparison
from pipeline.runtime import ROOT
from reports.base import style
from reports.figures import kinds
from reports.figures.loading_path import measures
from reports.figures.wave import contacts, edge_contacts, facts, figure
from reports.figures.wave.monitored_places import places, relative_error
from reports.study import StudyResults, deformed, from_dataset
from tests.reports import figure_assertions
from tests.tables import some

PROBLEM = ROOT / "experiments/fig7/problem.yaml"
CUTOFF = np.deg2rad(-10.0)


def test_a_mimicked_wave_has_its_own_report(shield: StudyResults, smile: StudyResults) -> None:
    wave = problem.load(PROBLEM)
    assert kinds.kind_of(wave).facts is facts.wave_facts
    assert kinds.kind_of(shield.problem).facts is not facts.wave_facts
    assert kinds.kind_of(smile.problem).facts is not facts.wave_facts


def test_void_angles_of_rotated_squares(smile: StudyResults) -> None:
    """Squares turned by 20 degrees leave voids of 50 and 130 degrees beside every ligament."""
    part = smile.response.sel(structure="intact")
    angles = np.degrees(contacts.rest_angles(from_dataset(part, 15.0)))
    np.testing.assert_allclose(np.sort(angles, axis=1), [[50.0, 130.0]] * len(angles), atol=1e-9)


def test_voids_close_by_turns_and_the_middle_of_an_edge_is_shown(smile: StudyResults) -> None:
    part = smile.response.sel(structure="intact").isel(case=0, time=[0]).copy(deep=True)
    structure = from_dataset(part, 15.0)
    rest = contacts.rest_angles(structure)
    k = int(np.argmin(rest[:, 0]))
    assert not contacts.closed(smile.problem, part).any()
    turned = {"time": 0, "unit": int(structure.ligament_unit[k, 0]), "dof": 2}
    part["displacement"][turned] = CUTOFF - rest[k, 0] - 1e-6
    found = contacts.closed(smile.problem, part)[0]
    assert found[k]
    assert contacts.smaller_angles(smile.problem, part)[0, k] == pytest.approx(CUTOFF - 1e-6)
    part = smile.response.sel(structure="altered")
    assert edge_contacts.on_edges(from_dataset(part, 15.0)).sum() == 2 * 14
    (place,) = places(smile.problem, smile.response)
    assert place.name == "unit (7, 14)"


def test_contacts_are_counted_by_the_law_that_the_study_runs_under(smile: StudyResults) -> None:
    """Close voids on angles without a touch, and bring units near without a closed void."""
    geometric = law_comparison.under(smile.problem, "geometric")
    angle = law_comparison.under(smile.problem, "angle")
    response = smile.response.sel(structure=["intact"]).isel(case=[0], time=[0]).copy(deep=True)
    structure = from_dataset(response.sel(structure="intact"), 15.0)
    k = int(np.flatnonzero(edge_contacts.on_edges(structure))[0])
    a, b = structure.ligament_unit[k]
    at_rest = edge_contacts.along_edges(geometric, response, contacts.contact_measure(geometric))
    np.testing.assert_allclose(at_rest.min(), smile.problem.lattice.ligament_length, rtol=1e-9)
    apart = structure.site[b] - structure.site[a]
    near = apart / np.linalg.norm(apart) * (float(at_rest.min()) - 0.01)
    moved = {"structure": 0, "case": 0, "time": 0, "unit": int(a)}
    response["displacement"][moved | {"dof": slice(0, 2)}] = near
    laws = (geometric, angle)
    measures = [contacts.contact_measure(each) for each in laws]
    counted = [
        edge_contacts.edge_contacts(geometric, response, measure).item() for measure in measures
    ]
    assert counted == [1, 0]
    assert contacts.void_measure(geometric) == measures[1]
    part = response.sel(structure="intact").isel(case=0)
    frame = part["displacement"].isel(time=0).transpose("unit", "dof").values
    middle = contacts.middles(structure, deformed(structure, frame))[k]
    places = contacts.contact_places(geometric, part, 0)
    np.testing.assert_allclose(places, [middle], atol=0.1)
    assert contacts.contact_places(angle, part, 0).size == 0
    assert contacts.contact_measure(geometric).column == "edge_distance_mm"


def test_relative_error_by_hand(smile: StudyResults) -> None:
    inside = smile.response["displacement"].isel(unit=smile.response["roi"].values.astype(bool))
    scaled = inside.isel(case=0).transpose("structure", "time", "unit", "dof") / [15.0, 15.0, 1.0]
    intact, altered = (scaled.sel(structure=name).values for name in ("intact", "altered"))
    time = smile.response["time"].values

    def size(field: np.ndarray) -> float:
        return float(np.trapezoid((field**2).sum(axis=(1, 2)), time) ** 0.5)

    found = relative_error(smile.problem, smile.response).isel(case=0)
    expected = size(altered - intact) / size(intact)
    assert float(found.sel(structure="altered")) == pytest.approx(expected)
    assert float(found.sel(structure="intact")) == 0.0
    scale = measures.scales(smile.problem)
    falling = smile.response.copy(deep=True)
    turned = falling["displacement"][:, :, ::-1].assign_coords(time=smile.response["time"])
    falling["displacement"] = turned
    at_end = measures.size_of_intact(smile.response, scale, static=True)
    np.testing.assert_allclose(measures.size_of_intact(falling, scale, static=False), at_end)


def in_cases(study: StudyResults, degrees: list[float]) -> StudyResults:
    """The study whose structures miss the intact one three times as far in all cases but one."""
    ways = tuple(np.radians([*study.response["direction"].values, *degrees]))
    drive = study.problem.drive.model_copy(update={"directions": ways, "weights": None})
    second = study.response
    intact = second["displacement"].sel(structure="intact", drop=True)
    farther = intact + 3.0 * (second["displacement"] - intact)
    second = second.assign(displacement=farther.transpose(*second["displacement"].dims))
    others = (second.assign_coords(direction=("case", [degree])) for degree in degrees)
    made = xr.concat([study.response, *others], "case", data_vars="minimal", coords="minimal")
    response = made.assign_attrs(study.response.attrs)
    posed = study.problem.model_copy(update={"drive": drive})
    return replace(study, problem=posed, datasets={"design": study.design, "response": response})


def test_the_largest_error_is_that_of_any_load_case(smile: StudyResults) -> None:
    """A mean over the cases would be two thirds of it."""
    one = {fact.key: fact for fact in facts.error_facts(smile)}
    two = {fact.key: fact for fact in facts.error_facts(in_cases(smile, [0.0]))}
    for name in ("altered", "cloaked"):
        assert two[f"peak_{name}"].value == pytest.approx(3 * one[f"peak_{name}"].value)
        assert two[f"error_{name}"].value == pytest.approx(2 * one[f"error_{name}"].value)
        assert (
            two[f"peak_{name}"].note == f"{one[f'peak_{name}'].note}; the largest of any load case"
        )
        mean = f"{one[f'error_{name}'].note}; weighted mean of the load cases"
        assert two[f"error_{name}"].note == mean


@pytest.mark.parametrize(
    ("length", "told"), [(2e-5, "steps of 20 µs"), (np.nan, "steps graded in time")]
)
def test_graded_steps_are_told_in_words(length: float, told: str) -> None:
    one = {"loss": 0.1, "error": 0.2, "departure": 0.0, "time_step": length, "overlaps": 0}
    numbers = {name: (("check", "structure"), [[value] * 2]) for name, value in one.items()}
    made = xr.Dataset(
        numbers | {"status": ("check", ["ok"])},
        {"check": ["as run"], "structure": ["altered", "cloaked"]},
    )
    found = list(facts.step_facts(made))
    assert {fact.note for fact in found} == {f"relative error 0.2; {told}; none overlap"}


@pytest.mark.parametrize("degrees", some([[], [90.0, 0.0, 270.0], [90.0], [180.0, 180.0]]))
def test_the_figure_of_several_loads_fits_a_page(smile: StudyResults, degrees: list[float]) -> None:
    """The legend stands between title and curves, and is for all panels; of alike loads longest."""
    study = in_cases(smile, degrees) if degrees else smile
    with style.styled():
        made = figure_assertions.drawn(figure.wave_figure(study).draw())
    figure_assertions.assert_legible(made)
    assert len(made.legends) == bool(degrees)
    axes = next(axes for axes in made.axes if axes.get_ylabel() == "$u_y$ (mm)" and axes.lines)
    for legend in made.legends:
        box = legend.get_window_extent()
        assert axes.get_window_extent().y1 <= box.y0
        assert made.bbox.x0 <= box.x0 < box.x1 <= made.bbox.x1
        titles = [text for text in made.texts if text.get_text().startswith("Vertical")]
        assert box.y1 <= titles[0].get_window_extent().y0
        assert len(legend.get_texts()) == 3 * (1 + len(degrees))
