"""Stage: finds the constants of a specimen from measurements, with their errors."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline import datasets
from pipeline.calibration import (
    calibration_dataset,
    computed_sets,
    fit_calibration,
    simulation_fault,
)
from pipeline.calibration.inputs import Calibration
from pipeline.datasets import provenance
from pipeline.problem.reading import load_section
from pipeline.runtime import UserError, cli, write_atomically
from sim.core import SimulationError

LOG = logging.getLogger(__name__)

DESCRIPTION = """\
Find stiffness and damping of a specimen from measurements.

  python -m pipeline.stages.calibrate CALIBRATION.yaml --out NC
  python -m pipeline.stages.calibrate synthesise CALIBRATION.yaml --out-dir FOLDER

The first writes the constants with their errors to NC, and beside it a YAML of the same name: the
lines that a problem file takes. The second computes the sets that the calibration calls virtual,
and writes them with a calibration.yaml that names them, which the first then takes. These are
labelled SYNTHETIC.
"""


def parser() -> argparse.ArgumentParser:
    """The stage's command line."""
    made = cli.parser("pipeline.stages.calibrate", DESCRIPTION, study=False)
    made.add_argument("words", nargs="+", metavar="[COMMAND] FILE", help="what to read")
    made.add_argument("--out", type=Path, metavar="NC", help="dataset to write")
    made.add_argument("--out-dir", type=Path, metavar="FOLDER", help="of the computed files")
    return made


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
    fit = fit_calibration(asked, path)
    try:
        made, found = calibration_dataset.assemble_calibration(fit)
    except SimulationError as error:
        raise simulation_fault(error, path) from error
    for line in filter(None, made.attrs["warnings"].split("\n")):
        LOG.warning("warning: %s", line)
    parents = {each.name: path.parent / each.file for each in asked.data if each.file is not None}
    origin = provenance.of_recording(
        asked.model_dump_json(), parents, synthetic=asked.synthetic, role="calibration"
    )
    datasets.write(made, args.out, "calibration", origin)
    words = calibration_dataset.material_fragment(
        fit, found, asked.title, synthetic=asked.synthetic
    )
    with write_atomically(args.out.with_suffix(".yaml")) as aside:
        aside.write_text(words, encoding="utf-8")
    LOG.info("%s", words.rstrip())


def _synthesise(path: Path, args: argparse.Namespace) -> None:

    asked = load_section(path, Calibration)
    if asked.virtual is None:
        remedy = "its data are measured: run python -m pipeline.stages.calibrate FILE --out NC"
        raise UserError("nothing is virtual here", file=path, key="virtual", remedy=remedy)
    computed_sets.write_sets(asked, path, args.out_dir)
    LOG.info("%s: %s", computed_sets.LABEL, args.out_dir / computed_sets.YAML)


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
