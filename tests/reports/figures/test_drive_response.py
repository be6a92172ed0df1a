import dataclasses
import re

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import ArrowStyle, FancyArrowPatch

from pipeline.problem import selected_units
from pipeline.problem.sections import ForceDrive, RotationDrive, TimeSeriesDrive, TorqueDrive
from reports.figures.loading_path import abscissa, curves
from reports.figures.loading_path.drive_response import drive_response
from reports.figures.loading_path.structure_panels import rest_panel
from reports.study import StudyResults
from tests.reports.loading_paths import made, values


@pytest.mark.parametrize(
    ("course", "angle", "look"),
    [
        ((0.0, 1.0, 3.0), 180.0, "-|>"),
        ((0.0, -1.0, -3.0), 0.0, "-|>"),
        ((0.0, 3.0, -2.9), 0.0, "<|-|>"),
    ],
)
@pytest.mark.parametrize("turn", [0.0, 90.0])
def test_a_measured_motion_is_answered_along_its_largest_displacement(
    smile: StudyResults, course: tuple[float, ...], angle: float, look: str, turn: float
) -> None:
    """The arrows lie along it too; one that goes to both sides has two heads."""
    drive = TimeSeriesDrive.model_validate(
        {"kind": "time_series", "units": "right", "file": "shaker.csv"}
    )
    asked = smile.problem.model_copy(update={"drive": drive})
    response = smile.response.isel(time=slice(0, 3)).copy(deep=True)
    way, across = np.radians(180.0 + turn), np.radians(90.0 + turn)
    for key, far in (("displacement", np.array(course)), ("reaction_force", np.ones(3))):
        moved = np.stack([far * np.cos(way), far * np.sin(way), 0.0 * far], axis=-1)
        response[key] = moved_as(response[key], moved)
    response["reaction_force"] += 5.0 * xr.DataArray(
        [np.cos(across), np.sin(across), 0.0], dims="dof"
    )
    forces = drive_response(asked).of(response).isel(structure=0, case=0)
    shown = np.radians(angle + turn)
    driven = len(selected_units(drive.units, asked.lattice))
    np.testing.assert_allclose(forces, driven * np.cos(shown - way), atol=1e-9)
    axes = Figure().add_subplot()
    rest_panel(axes, asked, response, "altered")
    arrows = [each for each in axes.patches if isinstance(each, FancyArrowPatch)]
    assert len(arrows) == 3
    for each in arrows:
        start, end = np.array(vars(each)["_posA_posB"])
        along = (end - start) / np.linalg.norm(end - start)
        np.testing.assert_allclose(along, [np.cos(shown), np.sin(shown)], atol=1e-9)
        assert type(each.get_arrowstyle()) is ArrowStyle.get_styles()[look]


def moved_as(values: xr.DataArray, course: np.ndarray) -> xr.DataArray:
    """Returns values in which all units follow one course (time, dof)."""
    return xr.zeros_like(values) + xr.DataArray(course, dims=("time", "dof"))


@pytest.mark.parametrize(
    ("drive", "name", "amplitude", "shown", "axis", "key"),
    [
        (ForceDrive, "force", "2 N", "$F$ = 2 N", "Displacement (mm)", "displacement_cloaked"),
        (TorqueDrive, "torque", "3 N mm", "$M$ = 3 N mm", "Rotation (°)", "turn_cloaked"),
        (RotationDrive, "rotation", "1 deg", r"$\theta$ = 1°", "Moment (N mm)", "moment_cloaked"),
    ],
)
def test_a_drive_is_answered_by_what_is_conjugate_to_it(
    smile: StudyResults,
    drive: type[ForceDrive | TorqueDrive | RotationDrive],
    name: str,
    amplitude: str,
    shown: str,
    axis: str,
    key: str,
) -> None:
    way = {"directions": ["180 deg"]} if name == "force" else {}
    given = {"kind": name, "units": "right", "amplitude": amplitude, **way}
    asked = drive.model_validate(given)
    problem = smile.problem.model_copy(update={"drive": asked})
    study = dataclasses.replace(smile, problem=problem)
    drawn = made(study)
    words = [text.get_text() for axes in drawn.axes for text in axes.texts]
    assert shown in [*words, *(text.get_text() for text in drawn.texts)]
    labels = [axes.get_ylabel() for axes in drawn.axes]
    # values that are zero, or nearly, have a power of ten before their unit
    assert axis in [re.sub(r"10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+ ", "", label) for label in labels]
    assert key in values(study)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_force_and_eigenvalue_share_a_zero_line(smile: StudyResults, sign: float) -> None:
    """Tell by it where the eigenvalue vanishes, also of forces against the drive."""
    turned = smile.response.assign(reaction_force=sign * smile.response["reaction_force"])
    study = dataclasses.replace(smile, datasets={**smile.datasets, "response": turned})
    axes = (figure := Figure()).add_subplot()
    curves.drive_panel(axes, study, abscissa.abscissa_of(study.problem, study.response))
    _, right = figure.axes
    places = [each.transData.transform((0.0, 0.0))[1] for each in (axes, right)]
    assert places[0] == pytest.approx(places[1])
    top, middle = axes.bbox.y1, (axes.bbox.y0 + axes.bbox.y1) / 2
    assert axes.bbox.y0 < places[0] < middle + 1e-6
    drawn = max(np.asarray(line.get_ydata()).max() for line in right.lines)
    assert right.transData.transform((0.0, drawn))[1] < top
