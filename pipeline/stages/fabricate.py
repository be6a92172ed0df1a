"""Stage: what a lab cuts, prints and assembles of one structure of a design."""

from __future__ import annotations

import argparse
import logging
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline import datasets, problem
from pipeline.fabrication import papers
from pipeline.fabrication.checks import STEPS, check_package
from pipeline.fabrication.files import package_folder
from pipeline.fabrication.papers import bill_of_materials, manifest
from pipeline.fabrication.parts import THIN_WALL, UnmadeError
from pipeline.fabrication.readback import draw
from pipeline.fabrication.units import network, specimen_units
from pipeline.runtime import cli, write_folder_atomically

LOG = logging.getLogger(__name__)

STRUCTURES = ("intact", "altered", "cloaked")


def work(args: argparse.Namespace) -> None:
    """Makes the parts, writes the package aside, checks it, and puts it in its place."""
    asked = problem.load(args.problem, args.preset)
    design = datasets.read(args.design, "design")
    net = network(design, args.structure)
    study = args.problem.resolve().parent.name + (f"@{args.preset}" if args.preset else "")
    pictures = args.out_dir.with_name(f"{args.out_dir.name}_faults")
    shutil.rmtree(pictures, ignore_errors=True)
    total = 2 * len(net.numbers) + 2 + STEPS
    with (
        cli.progress(total, f"fabrication, {args.structure}") as bar,
        write_folder_atomically(args.out_dir) as room,
    ):
        names = (study, args.structure)
        with _shown(pictures):
            made = specimen_units.specimen(net, asked.fabrication, names, args.design, bar.update)
        filled = package_folder.PackageFolder(room, made, asked, str(args.problem), bar.update)
        package_folder.write(filled)
        papers.write(room / "assembly.pdf", made, asked.fabrication)
        bill_of_materials.write(
            room / "bom.csv", made, asked.fabrication, asked.material.density, filled.contents
        )
        manifest.write(room, made, asked, args.design)
        check_package(room, design, args.structure, asked.fabrication, pictures, bar.update)
    LOG.info("%s: %s", args.out_dir, specimen_units.summary(made))
    if made.thin:
        thinnest = min(made.thin, key=lambda label: made.thin[label])
        told = (args.out_dir, len(made.thin), THIN_WALL, made.thin[thinnest], thinnest)
        LOG.warning("%s: %d units have walls under %g mm (from %.2f mm, unit %s)", *told)


@contextmanager
def _shown(pictures: Path) -> Iterator[None]:
    """Draws the unit that cannot be made into a folder, and tells of the picture."""
    try:
        yield
    except UnmadeError as error:
        path = draw(error.what, error.around, error.spot, pictures / "fault_1.png")
        error.remedy = f"{error.remedy}; see {path}"
        raise
