"""Stage: writes what a lab cuts, prints and assembles of one structure of a design."""

import argparse
import logging
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline import datasets, problem
from pipeline.fabrication.checks import STEPS, check_package
from pipeline.fabrication.files import PackageFolder
from pipeline.fabrication.papers import write_assembly_sheet, write_bill, write_manifest
from pipeline.fabrication.parts import THIN_WALL, UnbuildableUnitError
from pipeline.fabrication.readback import draw
from pipeline.fabrication.units import build_specimen, network, summary
from pipeline.runtime import cli, write_folder_atomically

LOG = logging.getLogger(__name__)


def work(args: argparse.Namespace) -> None:
    """Makes the parts, writes the package aside, checks it, and puts it in its place."""
    posed = problem.load(args.problem, args.preset)
    settings = posed.fabrication
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
        with _picture_of_fault(pictures):
            specimen = build_specimen(net, settings, names, args.design, bar.update)
        package = PackageFolder(room, specimen, posed, str(args.problem), bar.update)
        package.write()
        write_assembly_sheet(room / "assembly.pdf", specimen, settings)
        density = posed.material.density
        write_bill(room / "bom.csv", specimen, settings, density, package.contents)
        write_manifest(room, specimen, posed, args.design)
        check_package(room, design, args.structure, settings, pictures, bar.update)
    LOG.info("%s: %s", args.out_dir, summary(specimen))
    if specimen.thin:
        thinnest = min(specimen.thin, key=lambda label: specimen.thin[label])
        thin = (args.out_dir, len(specimen.thin), THIN_WALL, specimen.thin[thinnest], thinnest)
        LOG.warning("%s: %d units have walls under %g mm (from %.2f mm, unit %s)", *thin)


@contextmanager
def _picture_of_fault(pictures: Path) -> Iterator[None]:
    """Draws the unit that cannot be made into a folder, and names the picture."""
    try:
        yield
    except UnbuildableUnitError as error:
        path = draw(error.what, error.around, error.spot, pictures / "fault_1.png")
        error.remedy = f"{error.remedy}; see {path}"
        raise
