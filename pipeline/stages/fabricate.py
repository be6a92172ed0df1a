"""Stage: writes what a lab cuts, prints and assembles of one structure of a design."""

import argparse
import logging
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline import datasets, problem
from pipeline.fabrication.checks import STEPS, check_package
from pipeline.fabrication.files import PackageFolder
from pipeline.fabrication.papers import (
    bill_rows,
    stiffness_words,
    write_assembly_sheet,
    write_bill,
    write_manifest,
)
from pipeline.fabrication.parts import THIN_WALL, BuiltSpecimen, UnbuildableUnitError
from pipeline.fabrication.readback import draw
from pipeline.fabrication.units import build_specimen, network, summary
from pipeline.posing import (
    designed_angles,
    free_dofs,
    read_design,
    scene_of,
    stiffness_factors,
    structures_of,
)
from pipeline.problem import Problem
from pipeline.runtime import cli, write_folder_atomically
from sim.core import SimulationError
from sim.scene import Scene, as_built

LOG = logging.getLogger(__name__)

_STIFF = 0.95  # of the simulated stiffness, from which a shim is as simulated

WORSE = 1.5
"""Loss as built over that as designed, from which a specimen is another than was simulated."""


def work(args: argparse.Namespace) -> None:
    """Makes the parts, writes the package aside, checks it, and puts it in its place."""
    posed = problem.load(args.problem, args.preset)
    settings = posed.fabrication
    design = datasets.read(args.design, "design")
    net, scene = network(design, args.structure), scene_of(posed, args.problem.parent)
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
            built = build_specimen(net, settings, names, args.design, bar.update)
        free = {net.labels[n]: dofs for n, dofs in free_dofs(scene).items() if n in net.labels}
        factors = stiffness_factors(posed, args.structure)
        other = {
            ligament.number: tuple(factors[ligament.number].tolist())
            for ligament in built.ligaments
            if not np.allclose(factors[ligament.number], 1.0)
        }
        drives = tuple(
            tuple(net.labels[n] for n in group if n in net.labels)
            for group in problem.drive_groups(posed)
        )
        specimen = replace(built, free_dofs=free, stiffness=other, drives=drives)
        package = PackageFolder(room, specimen, posed, str(args.problem), bar.update)
        package.write()
        write_assembly_sheet(room / "assembly.pdf", specimen, settings)
        density = posed.material.density
        printing = (package.contents, package.prints, posed.infill)
        write_bill(room / "bom.csv", bill_rows(specimen, settings, density, *printing))
        simulated = _as_built(specimen, scene, posed, args)
        write_manifest(room, specimen, posed, args.design, simulated)
        check_package(room, design, args.structure, settings, pictures, bar.update)
    LOG.info("%s: %s", args.out_dir, summary(specimen))
    if specimen.thin:
        thinnest = min(specimen.thin, key=lambda label: specimen.thin[label])
        thin = (args.out_dir, len(specimen.thin), THIN_WALL, specimen.thin[thinnest], thinnest)
        LOG.warning("%s: %d units have walls under %g mm (from %.2f mm, unit %s)", *thin)
    if words := specimen.free_words:
        what = f"the study leaves free {words}, but the fixtures hold these units in every way"
        LOG.warning("%s: %s; guides for them are yours to make", args.out_dir, what)
    if words := stiffness_words(specimen):
        what = f"the study simulates {len(specimen.stiffness)} joints otherwise than with shims"
        remedy = "make them so (glue or screw stiffer ones), or it is another structure"
        LOG.warning("%s: %s (%s); %s", args.out_dir, what, words, remedy)
    if posed.material.foil is not None and (softer := foil_warning(specimen)) is not None:
        LOG.warning("%s: %s", args.out_dir, softer)
    if (worse := loss_warning(simulated or {})) is not None:
        LOG.warning("%s: %s", args.out_dir, worse)


def foil_warning(specimen: BuiltSpecimen) -> str | None:
    """Warns of shims that are freer, and so softer, than ligaments that were simulated as foil."""
    shares = [ligament.gap / ligament.free for ligament in specimen.ligaments if ligament.gap > 0.0]
    if not shares or (share := float(np.median(shares))) > _STIFF:
        return None
    free = float(np.median([ligament.free for ligament in specimen.ligaments]))
    return (
        "material.foil computes the stiffness of foil as long as the ligaments, but tips beside the"
        f" slots are cut back and shims are free in {free:.2f} mm (median): with {share:.2f} of the"
        f" axial and bending stiffness and {share**3:.2f} of the shear stiffness; give measured"
        " constants instead (material.axial_stiffness and so on), or those of the free length"
    )


def loss_warning(built: Mapping[str, float | str]) -> str | None:
    """Warns of shims, bent as they are drawn, by which a specimen does worse than designed."""
    designed, loss = (float(built.get(f"loss_as_{how}", 0.0)) for how in ("designed", "built"))
    if designed == 0.0 or loss <= WORSE * designed:  # the intact structure has none to compare
        return None
    return (
        f"as built, its shims bent as drawn, the loss is {loss:.3g} for {designed:.3g} as designed;"
        " ask for optimiser.as_built, or for constraints.straight_shims"
    )


def _as_built(
    specimen: BuiltSpecimen, scene: Scene, posed: Problem, args: argparse.Namespace
) -> dict[str, float | str] | None:
    """Simulates the structure with its shims as drawn; None of one that the study does not load.

    A motion that cannot be followed is told in the place of its numbers: the files are right.
    """
    design = read_design(posed, args.design)
    structure = structures_of(scene, design, straight=True).get(args.structure)
    if structure is None:
        return None
    designed = designed_angles(design) if args.structure == "cloaked" else None
    angles = np.array([ligament.angles for ligament in specimen.ligaments]).reshape(-1, 2)
    try:
        found = as_built(*structure, angles, designed)
    except SimulationError as error:
        LOG.warning("%s: the structure as built cannot be simulated: %s", args.out_dir, error)
        return {"failure": str(error)}
    turn = np.degrees(np.abs(found.turn))
    return {
        "turn_mean_deg": round(float(turn.mean()), 3),
        "turn_max_deg": round(float(turn.max()), 3),
        "loss_as_designed": float(f"{found.loss_as_designed:.5g}"),
        "loss_as_built": float(f"{found.loss_as_built:.5g}"),
    }


@contextmanager
def _picture_of_fault(pictures: Path) -> Iterator[None]:
    """Draws the unit that cannot be made into a folder, and names the picture."""
    try:
        yield
    except UnbuildableUnitError as error:
        path = draw(error.what, error.around, error.spot, pictures / "fault_1.png")
        error.remedy = f"{error.remedy}; see {path}"
        raise
