"""What a drive that is known by measurement alone costs: by the adjoint as by differences."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipeline.calibration import computed_sets, computed_track
from pipeline.calibration.experiments import full_field
from pipeline.calibration.experiments.measured_drive import apply_changes
from pipeline.calibration.fit_uncertainty import drive_information, estimate_errors
from pipeline.calibration.inputs import TrackedMotion, start_constants
from pipeline.calibration.least_squares import Fit, FitModel
from pipeline.comparison import redrive
from pipeline.runtime import ROOT
from sim.core import Floats
from sim.solvers import PrescribedMotion
from tests.pipeline.calibration.specimens import TRUTH, described, loaded

SPECIMEN = ROOT / "experiments/calibration/specimens/shaken.yaml"
SLOWER = {
    "width: 25 ms": "width: 60 ms",
    "delay: 75 ms": "delay: 180 ms",
    "duration: 0.3 s": "duration: 0.45 s",
}
ERROR = {"displacement": "0.01 mm", "rotation": "0.05 deg"}


@pytest.fixture(scope="module")
def fit(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """A motion in time at its true constants, without errors of its steps, the drive's noise in."""
    folder = tmp_path_factory.mktemp("shaken")
    slower = SPECIMEN.read_text()
    for before, after in SLOWER.items():
        assert before in slower
        slower = slower.replace(before, after)
    (folder / SPECIMEN.name).write_text(slower)
    track: dict[str, Any] = {"kind": "track", "name": "motion", "structure": "altered"}
    track |= {
        "problem": SPECIMEN.name,
        "bias": ERROR,
        "virtual": {"rate": "120 Hz", "noise": ERROR, "bias": ERROR},
    }
    names = ["shear_stiffness", "damping_ratio"]
    asked = loaded(folder, described([track], names, material=TRUTH))
    begin, true, (each,) = start_constants(asked), computed_sets.true_constants(asked), asked.data
    assert isinstance(each, TrackedMotion)
    random = np.random.default_rng(0)
    seen = full_field.pose_track(
        each, folder, begin, computed_track.simulate_track(each, folder, true, random)
    )
    sigma = seen.measured.sigma
    values = seen.predict(true, np.zeros(0)) + sigma * random.normal(size=len(sigma))
    seen = replace(seen, measured=replace(seen.measured, values=values))
    seen = seen.with_drive_noise(true).with_drive_noise(true)
    model = FitModel(begin, asked.fit, [seen])
    at = true.logs(asked.fit)
    reach = np.stack([at - 1.0, at + 1.0], axis=1)
    return Fit(model, at, np.array([1.1]), model.residual(at), model.jacobian(at), reach)


def by_changes(fit: Fit, unknowns: Floats) -> Floats:
    """Derivatives (n, n_changes) of the prediction by the drive's changes, by differences."""
    (each,) = fit.model.experiments
    assert isinstance(each, full_field.FullFieldExperiment)
    assert each.drive is not None
    constants, units, motion = fit.model.constants(unknowns), each.drive.units, each.drive.motion
    assert isinstance(motion, redrive.HermiteMotion)
    step, columns = 1e-3, []
    for one in each.changes:
        ahead, behind = (
            each.simulation.predict(
                constants, PrescribedMotion(units, apply_changes(motion, [one], size))
            )
            for size in (np.array([step]), np.array([-step]))
        )
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, axis=1)


def test_what_is_lost_to_a_noisy_drive_is_that_of_its_definition(fit: Fit) -> None:
    (each,) = fit.model.experiments
    assert isinstance(each, full_field.FullFieldExperiment)
    measured, noise = each.measured, np.diag(1 / each.measured.sigma)
    weight = measured.whitened(np.eye(len(measured.values)))
    rho = weight.T @ fit.residual / fit.level[0]
    here = by_changes(fit, fit.unknowns)
    within = measured._less_mean(noise)
    known = np.linalg.inv(np.eye(here.shape[1]) + (within @ here).T @ (within @ here))
    columns = []
    for step in 1e-2 * np.eye(2):
        ends = [fit.unknowns + step, fit.unknowns - step]
        by_unknown, turned = (
            (f(ends[0]) - f(ends[1])) / 2e-2
            for f in (
                lambda at: each.predict(fit.model.constants(at), np.zeros(0)),
                lambda at: by_changes(fit, at).T @ rho,
            )
        )
        straight = (within @ here).T @ within @ by_unknown
        columns.append((straight, turned))
    straight, turned = (np.stack(part, axis=1) for part in zip(*columns, strict=True))
    level = fit.level[0] ** 2
    whole = (straight / level + turned).T @ known @ (straight / level + turned)
    expected = level * (whole - straight.T @ known @ straight / level**2)
    found = drive_information(fit)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=0.02 * np.abs(expected).max())


def test_intervals_are_those_of_what_is_left_of_the_information(fit: Fit) -> None:
    known, information = estimate_errors(fit), fit.jacobian.T @ fit.jacobian
    np.testing.assert_allclose(known.bound @ information, np.eye(2), atol=1e-9)
    left = np.linalg.inv(information - drive_information(fit))
    np.testing.assert_allclose(known.covariance, left @ information @ left, rtol=1e-6)
    assert np.abs(drive_information(fit)).max() > 0.01 * information.min()
