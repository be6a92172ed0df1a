import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline.comparison import middle_units
from reports.figures.loading_path import (
    abscissa,
    figure,
    measured,
    measures,
    monte_carlo,
    tables,
)
from reports.figures.loading_path import facts as path_facts
from reports.figures.loading_path.drive_response import drive_response
from reports.figures.several_studies.figure import several_studies_figure
from reports.study import CLAMPED, DRIVEN, StudyResults
from tests.reports import compressed_study, recorded_study
from tests.reports.loading_paths import motion, values

S = 15.0


def test_mean_rotation_by_hand(shield: StudyResults) -> None:
    units = np.flatnonzero(shield.response["roi"].values)
    for name in ("altered", "cloaked"):
        turned = motion(shield, name)[:, units, 2]
        expected = [np.degrees(sum(abs(turn) for turn in row) / len(units)) for row in turned]
        found = measures.rotation(shield.response).sel(structure=name).isel(case=0)
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert values(shield)["rotation_reduction"].value == pytest.approx(90.0)


def test_mimicking_error_by_hand(smile: StudyResults) -> None:
    units = np.flatnonzero(smile.response["roi"].values)
    intact, altered = (motion(smile, name)[:, units] for name in ("intact", "altered"))

    def size(field: np.ndarray) -> float:
        return float(sum((x / S) ** 2 + (y / S) ** 2 + turn**2 for x, y, turn in field) ** 0.5)

    expected = [size(altered[t] - intact[t]) / size(intact[-1]) for t in range(len(intact))]
    found = measures.measure_of(smile.problem).of(smile.response).sel(structure="altered")
    np.testing.assert_allclose(found.isel(case=0), expected, rtol=1e-12)
    assert measures.measure_of(smile.problem).of(smile.response).sel(structure="intact").max() == 0


def test_contraction_of_middle_columns_and_force_on_units(smile: StudyResults) -> None:
    waist = np.mean([np.sin(np.pi * i / 14) for i in range(4, 11)])
    found = measures.contraction(smile.problem, smile.response).isel(case=0, time=-1)
    for name, pull in compressed_study.DRAW.items():
        assert float(found.sel(structure=name)) == pytest.approx(pull * waist)
    assert middle_units(smile.problem, "bottom") == list(range(4, 11))
    forces = drive_response(smile.problem).of(smile.response).isel(case=0)
    np.testing.assert_allclose(forces.isel(time=-1), list(compressed_study.FORCE.values()))
    np.testing.assert_allclose(forces.isel(time=0), 0.0)


@pytest.mark.parametrize("support", [CLAMPED, DRIVEN])
def test_rows_that_are_held_have_no_lateral_contraction(smile: StudyResults, support: int) -> None:
    """Press the lattice from the top: how much nearer the rows come is the drive's displacement."""
    held = smile.response.copy(deep=True)
    held["support"].loc[{"unit": middle_units(smile.problem, "top")}] = support
    pressed = dataclasses.replace(smile, datasets={**smile.datasets, "response": held})
    for study, there in ((smile, True), (pressed, False)):
        whole, joint = figure.loading_path_figure(study), several_studies_figure([study])
        path = abscissa.abscissa_of(study.problem, study.response)
        assert ("Lateral contraction" in {panel.head[1] for panel in whole.panels}) == there
        assert bool(list(path_facts.contraction_facts(study, path))) == there
        assert ("cloaked_contraction_mm" in tables.path(study)) == there
        assert any("contraction" in panel.head[1] for panel in joint.panels) == there


def test_copies_are_measured_like_the_structure(shield: StudyResults, smile: StudyResults) -> None:
    units = smile.response["roi"].values.astype(bool)
    scaled = motion(smile, "intact")[-1, units] / [S, S, 1.0]
    relative = np.sqrt(units.sum()) / np.linalg.norm(scaled)
    for study, factor in ((shield, np.degrees(1.0)), (smile, relative)):
        copies, measure = study.scatter, measures.measure_of(study.problem)
        assert copies is not None
        found = monte_carlo.copy_curves(study.problem, measure, study.response, copies)
        np.testing.assert_allclose(found, factor * copies["rotation"], rtol=1e-12)


@pytest.mark.parametrize("of", [measures.motion, measures.mismatch])
def test_units_that_were_lost_do_not_count(
    smile: StudyResults, of: Callable[..., xr.DataArray]
) -> None:
    """Loses half of the units, which all miss the target by as much."""
    apart = smile.response.copy(deep=True)
    apart["displacement"][:] = 1.0
    apart["displacement"].loc[{"structure": "cloaked"}] = 3.0
    lost = apart.copy(deep=True)
    lost["displacement"].loc[{"structure": "cloaked", "unit": apart["unit"][::2]}] = np.nan
    seen, some = (of(made, (S, S, 1.0)).sel(structure="cloaked") for made in (apart, lost))
    np.testing.assert_allclose(some, seen)


@pytest.mark.parametrize("static", [True, False], ids=["static", "in time"])
def test_a_departure_is_over_the_size_of_the_units_seen(smile: StudyResults, static: bool) -> None:
    """Lose the units that move most: those left depart by as large a share of their motion."""
    course = xr.ones_like(smile.response["time"], dtype=float)
    course[len(course) // 2] = 2.0
    apart = smile.response.copy(deep=True)
    fast = apart["unit"] % 2 == 0
    apart["displacement"][:] = 1.0
    apart["displacement"] = apart["displacement"].where(~fast, 9.0) * course
    apart["displacement"].loc[{"structure": "cloaked"}] *= 1.5
    cloaked = apart["structure"] == "cloaked"
    lost = apart.assign(displacement=apart["displacement"].where(~(cloaked & fast)))
    expected = 0.5 * course / (1.0 if static else 2.0)
    for made in (apart, lost):
        found = measures.mismatch(made, (S, S, 1.0), static).sel(structure="cloaked")
        np.testing.assert_allclose(found.isel(case=0), expected)


def test_a_measured_motion_in_time_is_its_mean(study: StudyResults, tmp_path: Path) -> None:
    filmed = recorded_study.with_recordings(study, tmp_path, ("cloaked", 0))
    path = abscissa.abscissa_of(study.problem, study.response)
    found = {fact.key: fact.value for fact in measured.measured_facts(filmed, path)}
    key = measures.measure_of(study.problem).key
    [recording] = filmed.recordings
    course = measured.curve(filmed, path, recording, measures.measure_of(study.problem).of)
    rms = np.sqrt(np.nanmean(course**2))
    assert found[f"measured_{key}_cloaked"] == pytest.approx(float(rms))


def test_units_seldom_seen_are_left_out(smile: StudyResults, tmp_path: Path) -> None:
    """Leave them out where the comparison does, also while they are seen."""
    filmed = recorded_study.with_recordings(smile, tmp_path, ("cloaked", 0))
    path = abscissa.abscissa_of(smile.problem, smile.response)
    [recording] = filmed.recordings
    whole = recording.data["measured"]
    late = xr.zeros_like(whole["time"], dtype=bool)
    late[recording.frames[-2:]] = True
    hidden = whole.where(late | (whole["unit"] != whole["unit"][0]))
    some = dataclasses.replace(recording, data=recording.data.assign(measured=hidden))
    for each, seen in ((recording, True), (some, False)):
        assert each.data["measured"].isel(unit=0).notnull().any()
        shown = measured.response(smile, path, each)["displacement"].sel(structure="cloaked")
        assert bool(shown.isel(case=0, unit=0).notnull().any()) == seen
