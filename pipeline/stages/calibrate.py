"""Stage: finds the constants of a specimen from measurements, with their errors."""

import argparse
import logging
from pathlib import Path

from pipeline import datasets
from pipeline.calibration import (
    calibration_dataset,
    computed_sets,
    fit_calibration,
    simulation_fault,
)
from pipeline.calibration.inputs import Calibration, has_synthetic, source_files
from pipeline.datasets import provenance
from pipeline.problem.reading import load_section
from pipeline.runtime import UserError, begins_with, sidecar_path, write_atomically
from sim.core import SimulationError

LOG = logging.getLogger(__name__)


def work(args: argparse.Namespace) -> None:
    """Finds constants, or computes what they may be found from.

    Raises:
        UserError: a fault of the files.
    """
    *command, file = args.words
    known = {"": ("out", _fit), "synthesise": ("out_dir", _synthesise)}
    if (name := " ".join(command)) not in known:
        remedy = "give synthesise, or a calibration alone; see --help"
        raise UserError("no such command", value=name, remedy=remedy)
    wanted, do = known[name]
    if getattr(args, wanted) is None:
        option = "--" + wanted.replace("_", "-")
        raise UserError(f"{option} is wanted", remedy="see --help")
    do(Path(file), args)


def _fit(path: Path, args: argparse.Namespace) -> None:
    asked = load_section(path, Calibration)
    own = begins_with(calibration_dataset.FRAGMENT)
    parents = source_files(asked, path.parent)
    fragment = sidecar_path(args.out, path, *parents.values(), ending=".yaml", is_own=own)
    fit = fit_calibration(asked, path)
    try:
        made, found = calibration_dataset.assemble_calibration(fit)
    except SimulationError as error:
        raise simulation_fault(error, path) from error
    for line in filter(None, made.attrs["warnings"].split("\n")):
        LOG.warning("%s", line)
    synthetic = asked.synthetic or has_synthetic(asked.data, path.parent)
    origin = provenance.of_recording(
        asked.model_dump_json(), parents, synthetic=synthetic, role="calibration"
    )
    datasets.write(made, args.out, "calibration", origin)
    words = calibration_dataset.material_fragment(fit, found, asked.title, synthetic=synthetic)
    with write_atomically(fragment) as aside:
        aside.write_text(words, encoding="utf-8")
    LOG.info("%s", words.rstrip())


def _synthesise(path: Path, args: argparse.Namespace) -> None:
    asked = load_section(path, Calibration)
    if asked.virtual is None:
        remedy = "its data are measured: run python -m pipeline calibrate FILE --out NC"
        raise UserError("nothing is virtual here", file=path, key="virtual", remedy=remedy)
    computed_sets.write_sets(asked, path, args.out_dir)
    LOG.info("%s: %s", computed_sets.LABEL, args.out_dir / computed_sets.YAML)
