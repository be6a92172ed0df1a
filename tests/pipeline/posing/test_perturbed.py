"""Tests copies of a design whose slots turn: each comes to rest before its response counts."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

from pipeline import problem
from pipeline.posing import (
    PosedStructure,
    design_scene,
    drawn,
    scene_of,
    spread,
    structures_of,
)
from pipeline.problem import Problem
from pipeline.stages import robust_gains
from sim.core import Floats, SimulationError
from sim.scene import Scene, evaluate, relaxed, simulate
from sim.structure import Perturbation
from tests.pipeline import static, unchanged
from tests.tables import refused

TURNING = (
    "cloak: { ring: { inner: 16 mm, outer: 25 mm } }\n"
    "objective: { kind: strain_energy, target: rest, region: { disc: { radius: 16 mm } },"
    " robust: { copies: 3, geometry: 0.01, stiffness: 0.1, copy_sharpness: 4 } }\n"
)


class Study(NamedTuple):
    """Holds a study whose slots turn, and a design of it where some do."""

    asked: Problem
    folder: Path
    scene: Scene
    vector: Floats  # (n_variables,)
    vertices: Floats  # (n_vertices, 2) mm
    angles: Floats  # (n_ligaments, 2) of the slots, rad
    design: xr.Dataset


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = static.write(tmp_path_factory.mktemp("turning"), TURNING, 5, 3.0)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("optimiser: {", "optimiser: { as_built: true,"), "utf-8")
    asked = problem.load(path)
    scene = scene_of(asked, path.parent)
    vector = np.random.default_rng(2).normal(size=scene.space.n_variables)
    vertices = np.asarray(scene.space.vertices(vector))
    angles = np.asarray(scene.space.end_angles(vector))
    padded = spread(scene.lattice.padded(vertices), scene.lattice, scene.lattice.n_units)
    slots = {"end_angles": (("ligament", "end"), angles)}
    design = unchanged.design(asked, path.parent, slots, padded)
    return Study(asked, path.parent, scene, vector, vertices, angles, design)


@pytest.fixture(scope="module")
def posed(study: Study) -> PosedStructure:
    """Poses the cloak of that design, as it rests."""
    return structures_of(study.scene, study.design)["cloaked"]


@pytest.mark.parametrize(
    "sizes", [Perturbation(ligaments=0.1), Perturbation(geometry=0.1, assembly=(0.1, 0.01))]
)
def test_a_copy_is_at_rest_before_any_load(posed: PosedStructure, sizes: Perturbation) -> None:
    copy = drawn(*posed, sizes, (0, 1))
    assert copy.failure is None
    assert np.abs(copy.vertices - posed.vertices).max() > 1e-3
    assert np.abs(relaxed(copy.scene, copy.vertices).motion).max() < 1e-9


def test_stiffer_ligaments_are_those_of_the_structure_as_designed(
    study: Study, posed: PosedStructure
) -> None:
    """Draws a copy of the structure at rest, and one before its shims turn the units."""
    scene, vertices = study.scene, study.vertices
    copy = drawn(*posed, Perturbation(ligaments=0.1), (0, 1))
    names = ("axial_stiffness", "shear_stiffness", "bending_stiffness")
    plain = drawn(scene, vertices, Perturbation(ligaments=0.1), (0, 1)).scene.structure.material
    factors = {name: getattr(plain, name) for name in names}
    first = scene.updated(material=scene.structure.material._replace(**factors))
    rest = relaxed(first.bent(study.angles), vertices)
    np.testing.assert_allclose(copy.vertices, rest.vertices, atol=1e-8)
    losses = [
        float(simulate(each, vertices=there).loss)
        for each, there in ((copy.scene, copy.vertices), (rest.scene, rest.vertices))
    ]
    assert losses[0] == pytest.approx(losses[1], rel=1e-8)


def test_a_copy_without_an_equilibrium_tells_so(
    posed: PosedStructure, monkeypatch: pytest.MonkeyPatch
) -> None:
    def restless(*_: object) -> None:
        raise SimulationError("no equilibrium found")

    monkeypatch.setattr("pipeline.posing.perturbed.at_rest", restless)
    copy = drawn(*posed, Perturbation(ligaments=0.1), (0, 1))
    assert copy.failure == "the copy does not come to rest: no equilibrium found"


def test_gains_are_of_the_copies_that_an_optimiser_sees(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robust_gains, "read_design", lambda *_: study.design)
    found = robust_gains._loss(study.asked, study.folder / "problem.yaml", study.folder)
    wanted, _ = evaluate(design_scene(study.asked, study.folder), study.vector)
    assert found == pytest.approx(wanted, rel=1e-6)


def test_a_copy_that_cannot_be_simulated_is_told(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_: object, **__: object) -> None:
        raise SimulationError("no equilibrium found", step=2)

    monkeypatch.setattr(robust_gains, "simulate", failing)
    source = study.folder / "problem.yaml"
    what = "altered (robust) (copy 1 of 3) structure cannot be"
    with refused(what, "drive.amplitude", file=source):
        robust_gains._loss(study.asked, source, None, "robust")
