"""Stage: predicts a measured test from others; measures load cycles; tracks real pictures."""

import argparse
import logging
from pathlib import Path

from pipeline import datasets
from pipeline.calibration import simulation_fault, study_cycles, study_pictures
from pipeline.calibration.inputs import (
    ELASTIC_NAMES,
    UNITS,
    KnownPictures,
    LoadCycles,
    Population,
    has_synthetic,
)
from pipeline.calibration.population import BEYOND, draw_constants, validate_population
from pipeline.datasets import SYNTHETIC_LABEL, provenance
from pipeline.problem.fields import Section, named_files
from pipeline.problem.reading import load_section
from pipeline.runtime import write_atomically
from sim.core import SimulationError

LOG = logging.getLogger(__name__)

_DRAWN = {
    "emulator_beyond": "the samples' constants",
    "emulator_beyond_predicted": "new samples' constants",
}
"""Shares of draws that the emulated curves do not reach."""


def work(args: argparse.Namespace) -> None:
    """Makes the part that a command line names: samples, constants, cycles or pictures.

    Raises:
        UserError: a fault of the files.
    """
    parts = {"samples": _samples, "constants": _constants, "cycles": _cycles, "pictures": _pictures}
    try:
        parts[args.command](args)
    except SimulationError as error:
        raise simulation_fault(error, args.file) from error


def _samples(args: argparse.Namespace) -> None:
    asked, folder = load_section(args.file, Population), args.file.parent
    made = validate_population(asked, folder)
    synthetic = has_synthetic((*asked.data, asked.predict), folder)
    origin = _origin(asked, folder, "population", synthetic=synthetic)
    datasets.write(made, args.out, "population", origin)
    for name, what in _DRAWN.items():
        if beyond := made[name].item():
            LOG.warning(BEYOND, 100 * beyond, what)
    LOG.info(
        "the measured curve lies %s the band of a new sample",
        "inside" if made["inside"].item() else "outside",
    )


def _origin(asked: Section, folder: Path, role: str, *, synthetic: bool) -> dict[str, str]:
    """Records the provenance of what is made of a description and of all files that it names."""
    parents = named_files(asked, folder)
    return provenance.of_recording(asked.model_dump_json(), parents, synthetic=synthetic, role=role)


def _constants(args: argparse.Namespace) -> None:
    asked = load_section(args.file, Population)
    drawn = draw_constants(asked, args.file.parent, args.count)
    files = {args.file.name: args.file, **named_files(asked, args.file.parent)}
    source, synthetic = asked.source, has_synthetic(asked.data, args.file.parent)
    mark = [f"# {SYNTHETIC_LABEL}: found from computed data, not from specimens"]
    lines = [
        *(mark if synthetic else []),
        f"# Constants of new samples, drawn from what {args.file.name} finds of those measured",
        f"# Measured by {source.by}. {source.reference}",
        f"# Licence: {source.licence}. Made by python -m pipeline validate constants",
        *(f"# SHA-256 of {key}: {provenance.file_hash(path)}" for key, path in files.items()),
        ",".join(f"{name} ({UNITS[name]})" for name in ELASTIC_NAMES),
        *(",".join(f"{value:.5g}" for value in row) for row in drawn),
    ]
    with write_atomically(args.out) as aside:
        aside.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    LOG.info("%d draws: %s", len(drawn), args.out)


def _cycles(args: argparse.Namespace) -> None:
    asked, folder = load_section(args.file, LoadCycles), args.file.parent
    made = study_cycles(asked, folder)
    synthetic = has_synthetic(asked.records, folder)
    origin = _origin(asked, folder, "load_cycles", synthetic=synthetic)
    datasets.write(made, args.out, "load_cycles", origin)
    LOG.info("%d snaps in %d records", made.sizes["snap"], made.sizes["record"])


def _pictures(args: argparse.Namespace) -> None:
    asked, folder = load_section(args.file, KnownPictures), args.file.parent
    made = study_pictures(asked, folder)
    origin = _origin(asked, folder, "pictures", synthetic=asked.synthetic)
    datasets.write(made, args.out, "pictures", origin)
    LOG.info("%d of %d units found", int(made["seen"].sum()), made.sizes["unit"])
