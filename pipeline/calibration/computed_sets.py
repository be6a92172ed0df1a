"""Computes measurements from known constants, with noise."""

import copy
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pipeline import datasets
from pipeline.calibration import computed_track
from pipeline.calibration.experiments import force_displacement, free_decay
from pipeline.calibration.inputs import (
    Calibration,
    Constants,
    ForceDisplacement,
    FreeDecay,
    MeasurementSet,
    source_files,
    start_constants,
)
from pipeline.datasets import SYNTHETIC_LABEL, provenance
from pipeline.problem.fields import named_files
from pipeline.problem.reading import yaml_file
from pipeline.runtime import write_atomically
from sim.core import Floats

LABEL = f"{SYNTHETIC_LABEL}: computed, not measured"
YAML = "calibration.yaml"


def true_constants(asked: Calibration) -> Constants:
    """Returns the constants that computed data are made with."""
    assert asked.virtual is not None
    return start_constants(asked)._replace(
        material=asked.virtual.truth, cutoff=asked.virtual.cutoff_angle
    )


def simulate_forces(
    asked: ForceDisplacement, true: Constants, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """Simulates a test: displacements in mm and noisy forces in N."""
    assert asked.virtual is not None
    displacement = np.linspace(0.0, asked.virtual.end, asked.virtual.points + 1)[1:]
    force = force_displacement.pose_simulation(
        asked.lattice, asked.test, true, displacement
    ).predict(true)
    return displacement, force + asked.virtual.noise * random.normal(size=len(force))


def simulate_decay(
    asked: FreeDecay, true: Constants, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """Computes times in s and noisy angles in rad, of the oscillation about one hinge."""
    given = asked.virtual
    assert given is not None
    frequency = free_decay.hinge_frequency(true)
    time = np.arange(int(given.duration * given.rate)) / given.rate
    course = free_decay.decay_terms(time, true.ratio, frequency) @ [0.0, 0.0, given.amplitude, 0.0]
    return time, course + given.noise * random.normal(size=len(time))


def write_sets(asked: Calibration, path: Path, folder: Path) -> None:
    """Writes the computed sets of a calibration, whose YAML is `path`, and one that names them.

    Raises:
        UserError: the folder cannot be written to.
    """
    assert asked.virtual is not None
    data = copy.deepcopy(dict(yaml_file.read_yaml(path).data))
    for key, file in named_files(asked, path.parent).items():
        _set_value(data, key.split("."), os.path.relpath(file, folder))
    sets = data.pop("data")
    data.pop("virtual")
    true, files = true_constants(asked), source_files(asked, path.parent)
    for number, (each, raw) in enumerate(zip(asked.data, sets, strict=True)):
        if each.virtual is not None:
            del raw["virtual"]
            random = np.random.default_rng([asked.virtual.seed, number])
            own = {key: file for key, file in files.items() if key.startswith(f"data.{number}.")}
            parents = {"calibration": path, **own}
            raw["file"] = _write_set(each, parents, true, random, folder)
    with write_atomically(folder / YAML) as aside:
        text = yaml.safe_dump(
            {**data, "synthetic": True, "data": sets}, sort_keys=False, allow_unicode=True
        )
        aside.write_text(f"# {LABEL}\n{text}", encoding="utf-8")


def _set_value(data: Any, keys: Sequence[str], value: str) -> None:  # noqa: ANN401
    """Sets a value in nested mappings and lists, whose items go by their number."""
    *above, last = keys
    for key in above:
        data = data[int(key)] if isinstance(data, list) else data[key]
    data[last] = value


def _write_set(
    each: MeasurementSet,
    parents: Mapping[str, Path],
    true: Constants,
    random: np.random.Generator,
    folder: Path,
) -> str:
    """Writes a set, and returns the name of its file; of the `parents`, one is the calibration."""
    name = f"{each.name}.csv"
    if isinstance(each, ForceDisplacement):
        columns = (f"{each.columns.displacement} (mm)", f"{each.columns.force} (N)")
        _write_csv(folder / name, columns, *simulate_forces(each, true, random))
        return name
    if isinstance(each, FreeDecay):
        columns = (f"{each.columns.time} (s)", f"{each.columns.angle} (rad)")
        _write_csv(folder / name, columns, *simulate_decay(each, true, random))
        return name
    origin = provenance.of_recording(each.model_dump_json(), parents, synthetic=True)
    track = computed_track.simulate_track(each, parents["calibration"].parent, true, random)
    datasets.write(track, folder / f"{each.name}.nc", "track", origin)
    return f"{each.name}.nc"


def _write_csv(path: Path, heading: tuple[str, ...], *columns: Floats) -> None:
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    with write_atomically(path) as aside:
        text = "\n".join([f"# {LABEL}", ",".join(heading), *rows])
        aside.write_text(text + "\n", encoding="utf-8")
