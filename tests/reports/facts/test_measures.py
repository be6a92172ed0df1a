import dataclasses

import numpy as np
import pytest
import xarray as xr

from reports.facts import measures
from reports.study import CLOAK, StudyResults, from_dataset
from tests.reports import shaken_study


def test_magnitudes_and_their_mean_over_the_window() -> None:
    motion = xr.DataArray([[3.0, 4.0, 0.0], [15.0, 0.0, 1.0]], dims=("unit", "dof"))
    motion = motion.assign_coords(dof=["ux", "uy", "theta"])
    found = measures.magnitude(motion, np.array([15.0, 15.0, 1.0]))
    np.testing.assert_allclose(found, [5.0 / 15.0, np.sqrt(2.0)])
    time = np.array([0.0, 1.0, 2.0, 3.0])
    window = np.zeros((1, 1, 4, 2, 3))
    window[0, 0, :, 0, 0] = [0.0, 15.0, 30.0, 900.0]  # in the region
    window[0, 0, :, 1, 0] = 1e6  # outside it
    response = xr.Dataset(
        {
            "displacement": (("structure", "case", "time", "unit", "dof"), window),
            "roi": ("unit", [1, 0]),
        },
        {"structure": ["altered"], "time": time, "dof": ["ux", "uy", "theta"]},
    )

    class Scaled:
        scale = np.array([15.0, 15.0, 1.0])

    mean = measures.mean_magnitude(response, Scaled, 2.0)  # type: ignore[arg-type]
    assert mean.item() == pytest.approx((0.5 * 0 + 1 + 0.5 * 2) / 2)


def test_reduction_is_what_the_motion_was_scaled_by(study: StudyResults) -> None:
    mean = measures.mean_magnitude(study.response, study.scene, study.scene.horizon).mean("case")
    assert measures.reduction(mean) == pytest.approx(1 - shaken_study.REACH["cloaked"])


def test_peak_to_peak_of_a_swing() -> None:
    time = np.linspace(0, 2, 401)
    series = xr.DataArray(time * np.sin(4 * np.pi * time), dims="time", coords={"time": time})
    assert measures.peak_to_peak(series, 2.0).item() > measures.peak_to_peak(series, 1.0).item()
    first = series.sel(time=slice(None, 1.0 + 1e-9))
    assert measures.peak_to_peak(series, 1.0).item() == float(first.max() - first.min())


def test_asymmetry_of_one_moved_vertex(study: StudyResults) -> None:
    structure = from_dataset(study.design, study.scene.spacing)
    distances = measures.asymmetry(structure, study.scene.middle)
    assert len(distances) == 4 * 69
    assert distances.max() < 1e-9  # as it has a four-fold symmetry
    unit = int(np.flatnonzero(structure.region == CLOAK)[0])
    vertices = structure.vertices.copy()
    vertices[unit, 2] += [0.3, 0.4]
    moved = dataclasses.replace(structure, vertices=vertices)
    distances = measures.asymmetry(moved, study.scene.middle)
    np.testing.assert_allclose(np.sort(distances)[-2:], 0.5, rtol=1e-9)
    assert np.sort(distances)[-3] < 1e-9


def test_porosity_of_the_initial_lattice(study: StudyResults) -> None:
    initial = from_dataset(study.design, study.scene.spacing, "vertices_initial")
    middle = study.scene.middle
    whole = measures.porosity(initial, middle, 0.0, 100.0)
    assert whole == pytest.approx(1 - 92.049 / 225, abs=0.01)
    assert measures.porosity(initial, middle, 0.0, 4.0) == pytest.approx(0.0)
    assert measures.porosity(initial, middle, 400.0, 410.0) == 1.0


def test_first_evaluation_that_is_near_the_best() -> None:
    history = np.array([2.0, 3.0, 1.0, np.nan, 0.3, 0.2, 0.25])
    assert measures.first_within(history, 0.2, 0.9) == 4
    assert measures.first_within(history, 0.2, 0.0) == 0
