"""A lattice of 7 x 7 squares that turn against each other while they close up."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from pipeline import datasets
from pipeline.problem.sections import VirtualRecording
from pipeline.tracking.frames import import_video
from pipeline.virtual_lab import prepare_film, select_case
from pipeline.virtual_lab.filming import VirtualFilm
from tests.pipeline.samples import sample

GRID = yaml.safe_load("""
{ name: grid, grid: [7, 7], spacing_mm: 15.0, ligament_gap_mm: 2.3, bias_angle_deg: 20.0 }
""")
SETUP = yaml.safe_load("""
{ rate: 20 Hz, still: 0.1 s,
  camera: { image: [320, 320], tilt: [2 deg, -1 deg], distortion: [0.01, 0.0] } }
""")


def response(design: xr.Dataset) -> xr.Dataset:
    made = sample("response").assign_coords(time=np.linspace(0, 1, 11))
    made = made.assign_coords({name: design[name] for name in ("unit", "i", "j")})
    there = np.ones(3)[:, None, None, None]
    share = np.linspace(0, 1, made.sizes["time"])[:, None]
    turn = np.where((design["i"] + design["j"]).values % 2 == 0, -0.3, 0.3)
    place = design["centroid"].values
    motion = np.stack(
        [-0.04 * share * place[:, 0], 0.02 * share * place[:, 1], share * turn], axis=-1
    )
    dims = made["displacement"].dims
    return made.assign(
        vertices=(made["vertices"].dims, there * design["vertices"].values),
        displacement=(dims, np.broadcast_to(motion, made["displacement"].shape)),
        region=design["region"],
        ligament_unit=design["ligament_unit"],
        ligament_vertex=design["ligament_vertex"],
    )


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with design.nc and response.nc."""
    folder = tmp_path_factory.mktemp("lattice")
    design = import_video.design(GRID)
    origin = {"problem": "{}", "problem_hash": "", "parents": "{}"}
    datasets.write(design, folder / "design.nc", "design", origin)
    datasets.write(response(design), folder / "response.nc", "response", origin)
    return folder


def film_of(kind: str, **changes: object) -> VirtualFilm:
    """Prepares the film of the cloaked structure of the lattice, under one load case."""
    one = select_case(response(import_video.design(GRID)), "cloaked", 0)
    setup = VirtualRecording.model_validate({**SETUP, **changes})
    return prepare_film(one, "cloaked", kind, setup)


@pytest.fixture
def film() -> VirtualFilm:
    """The cloaked structure of the lattice, bare, in the virtual lab."""
    return film_of("bare")
