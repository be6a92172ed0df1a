from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import problem
from pipeline.posing import PosedStructure, scene_of, spread, structures_of
from pipeline.problem import Problem, void_units
from reports.facts import foil
from reports.study import StudyResults
from sim.scene import foil_strains, simulate
from sim.structure import parameters_at
from tests.pipeline import static, unchanged
from tests.reports import compressed_study

SHIELD = (
    "cloak: { ring: { inner: 16 mm, outer: 25 mm } }\n"
    "objective: { kind: strain_energy, target: rest, region: { disc: { radius: 16 mm } } }\n"
)


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    return problem.load(static.write(tmp_path_factory.mktemp("shield"), SHIELD, 5, 3.0))


def bent(asked: Problem, angles: np.ndarray) -> xr.Dataset:
    """The unchanged design with slots at angles (n_ligaments, 2), rad, to their ligaments."""
    slots = {"end_angles": (("ligament", "end"), angles)}
    return unchanged.design(asked, Path(), slots)


def response(asked: Problem, structures: dict[str, PosedStructure]) -> xr.Dataset:
    """The structures at rest."""
    made = compressed_study.response(asked, Path("problem.yaml"))
    for name, (scene, vertices) in structures.items():
        padded = spread(scene.lattice.padded(vertices), scene.lattice, made.sizes["unit"])
        made["vertices"].loc[{"structure": name}] = padded
    return made.assign(displacement=0.0 * made["displacement"])


def test_shims_in_the_void_are_strained_in_the_intact_lattice_alone(smile: StudyResults) -> None:
    moved = 0.0 * smile.response["displacement"]
    moved.loc[{"structure": "intact", "unit": void_units(smile.problem)[0], "dof": "theta"}] = 0.1
    still = smile.response.assign(displacement=moved)
    found = foil.shim_extremes(smile.problem, smile.design, still)
    assert found["intact"].strain > 0.01
    assert found["intact"].bend == pytest.approx(0.1)
    assert found["altered"].strain == found["cloaked"].strain == 0.0


@pytest.mark.parametrize(
    ("structure", "limit", "asks"),
    [("cloaked", None, True), ("cloaked", 1e-3, False), ("intact", None, False)],
)
def test_a_warning_asks_for_a_limit_that_would_help(
    structure: str, limit: float | None, asks: bool, smile: StudyResults
) -> None:
    moved = 0.0 * smile.response["displacement"]
    moved.loc[{"structure": structure, "unit": 0, "dof": "theta"}] = 1.0
    still = smile.response.assign(displacement=moved)
    limits = smile.problem.constraints.model_copy(update={"shim_strain": limit})
    problem = smile.problem.model_copy(update={"constraints": limits})
    (told,) = foil.strain_warning(problem, smile.design, still)
    assert f": {structure} " in told
    assert "take thinner foil" in told
    assert ("ask for constraints.shim_strain" in told) == asks


def test_slots_strain_the_shims_that_they_bend_before_any_load(asked: Problem) -> None:
    n_ligaments = scene_of(asked, Path()).lattice.n_ligaments
    design = bent(asked, np.radians([20.0, -20.0]) * np.ones((n_ligaments, 1)))
    posed = {"cloaked": structures_of(scene_of(asked, Path()), design, straight=True)["cloaked"]}
    found = foil.shim_extremes(asked, design, response(asked, posed))  # its units held
    bend = np.radians(40.0)
    assert found["cloaked"].bend == pytest.approx(bend)
    thickness, length = asked.shim_thickness, 2.25  # strain t / 2 by curvature kappa / l
    assert found["cloaked"].strain == pytest.approx(thickness / 2 * bend / length)
    assert found["altered"].strain == 0.0


def test_strains_count_from_straight_shims_wherever_the_units_rest(asked: Problem) -> None:
    scene = scene_of(asked, Path())
    random = np.random.default_rng(3)
    design = bent(asked, np.radians(random.uniform(-20, 20, (scene.lattice.n_ligaments, 2))))
    posed = structures_of(scene, design)
    made, (scene, vertices) = response(asked, posed), posed["cloaked"]
    motion = simulate(scene, vertices=vertices).displacement[0]
    steps = made.isel(time=range(len(motion)))
    padded = spread(motion, scene.lattice, made.sizes["unit"], axis=1)
    steps["displacement"].loc[{"structure": "cloaked", "case": 0}] = padded
    found = foil.shim_extremes(asked, design, steps)["cloaked"]
    values = parameters_at(scene.lattice, vertices, scene.structure.material)
    ends = motion[:, scene.lattice.ligament_units]
    wanted = np.abs(foil_strains(ends, values, asked.shim_thickness)).max()
    assert found.strain == pytest.approx(float(wanted), rel=1e-9)
