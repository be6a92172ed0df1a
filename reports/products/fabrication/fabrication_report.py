"""Makes the page that shows what is built of a study: sheets, plates, specimens.

It reads the packages and nothing else of the study's results, so a picture shows a file and not
what the file was meant to be. The same packages give the same bytes.
"""

import argparse
import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline import problem
from pipeline.fabrication.files import LAYER_COLOURS
from pipeline.fabrication.papers import DRAWN_TWICE, read_bill, read_manifest
from pipeline.fabrication.parts import STRAIGHT, THIN_WALL
from pipeline.posing import loss_units
from pipeline.problem import Problem
from pipeline.problem.sections import Fabrication
from pipeline.runtime import cli
from reports.facts import worded
from reports.page import titled, write_page
from reports.products.fabrication import pictures

TITLES = {
    "intact": "Intact structure",
    "altered": "Altered structure",
    "cloaked": "Cloaked structure",
}
COLOURS = {"intact": "#8a8f96", "altered": "#f0a042", "cloaked": "#8d62c0"}
"""Of printed units, lighter than a structure's own colour so that edges show."""

FIXTURE = "#c8ccd0"
YIELD = 0.05
"""Strain of polyester foil (biaxially drawn) beyond which it stays bent: about where the stress in
makers' tensile curves leaves the straight line for good."""

_HOWS = ("designed", "built")
Picture = dict[str, str]
"""Of a file (its path from the page): `file`, `caption`, and `png` as base64."""
_BENT = "the specimen from the top, with the strain of every shim that is bent by its slots"


@dataclass(frozen=True)
class PackageFact:
    """Describes a figure in words."""

    value: str
    label: str
    note: str


def report(args: argparse.Namespace) -> None:
    """Makes the page that a command line asks for."""
    asked = problem.load(args.problem, args.preset)
    made = []
    with cli.progress(len(args.packages), "pictures of fabrication") as bar:
        for folder in args.packages:
            made.append(package(folder, asked))
            bar.update()
    packages = list(zip(made, args.packages, strict=True))
    values = {
        "title": f"{titled(asked, args.problem)}: what is built",
        "lead": "Drawings for the laser cutter, plates for the printer, fixtures and papers.",
        "pens": list(LAYER_COLOURS.items()),
        "structures": made,
        "as_built": list(as_built(asked, {each["name"]: read_manifest(p) for each, p in packages})),
        "parameters": list(parameters(asked.fabrication.model_dump(mode="json"))),
    }
    write_page(args.out, "fabrication.html.j2", values)


def as_built(asked: Problem, told: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, ...]]:
    """Yields rows of a table by structure: what is told, as designed, as built."""
    found = {name: each["as_built"] for name, each in told.items() if each["as_built"]}
    for name, each in found.items():
        title = TITLES.get(name, name)
        if "failure" in each:
            yield title, "", f"cannot be simulated: {each['failure']}"
            continue
        turn = f"{each['turn_mean_deg']:.2f}° on average, {each['turn_max_deg']:.2f}° at most"
        yield f"{title}: units turn before any load by", "0", turn
        if name != "intact":
            losses = (worded(each[f"loss_as_{how}"], loss_units(asked), 4) for how in _HOWS)
            yield f"{title}: loss J", *losses
    pair = [found.get(name, {}) for name in ("cloaked", "altered")]
    if all("loss_as_built" in each for each in pair):
        ratios = (pair[0][f"loss_as_{how}"] / pair[1][f"loss_as_{how}"] for how in _HOWS)
        yield "Loss J, cloaked over altered", *(f"{100 * ratio:.1f} %" for ratio in ratios)


def package(folder: Path, problem: Problem) -> dict[str, Any]:
    """Tells what the page shows of a package, all of it read from the package's files."""
    told = read_manifest(folder)
    name = folder.name
    return {
        "name": name,
        "title": TITLES.get(name, name),
        "facts": list(_facts(folder, told, problem.fabrication)),
        "groups": list(_groups(folder, problem)),
        "foil": [
            (row["id"], row["count"], row["note"])
            for row in read_bill(folder / "bom.csv")
            if row["item"] == "foil"
        ],
        "files": sorted(told["files"].items()),
    }


def parameters(values: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    """Yields dotted keys and values."""
    for key, value in values.items():
        if isinstance(value, dict):
            yield from parameters(value, f"{above}{key}.")
        else:
            listed = value if isinstance(value, list) else [value]
            yield f"{above}{key}", ", ".join(str(item) for item in listed)


def _facts(folder: Path, told: Mapping[str, Any], settings: Fabrication) -> Iterator[PackageFact]:
    bill = read_bill(folder / "bom.csv")
    total = {row["id"]: row for row in bill if row["item"] == "total"}
    units, shims = total["units"], total["shims"]
    kinds = len(told["shims"])
    first, last = told["units"][0], told["units"][-1]
    yield PackageFact(units["count"], "units", f"{first} to {last}")
    yield PackageFact(shims["count"], "shims with spares", f"of {kinds} length{'s' * (kinds != 1)}")
    mass = f"{float(units['mass_g']):.0f} g"
    yield PackageFact(mass, "mass of the units, simulated", units["note"])
    if thin := told["thin_walls_mm"]:
        note = f"thinnest {min(thin.values()):.2f} mm; the bill of materials names them"
        yield PackageFact(f"{len(thin)}", f"units with walls under {THIN_WALL:g} mm", note)
    if strains := sorted(one["strain"] for one in told["prebend"].values()):
        note = (
            f"median {100 * strains[len(strains) // 2]:.1f} %;"
            f" {sum(strain > YIELD for strain in strains)} of {len(strains)} beyond"
            f" {100 * YIELD:g} %, where polyester begins to yield"
        )
        yield PackageFact(f"{100 * strains[-1]:.1f} %", "strain of a shim before any load", note)
    if free := sorted(one["free_mm"] for one in told["prebend"].values()):
        note = f"at the median, {free[-1]:.2f} mm at most: between the walls that hold a shim"
        yield PackageFact(f"{free[len(free) // 2]:.2f} mm", "free length of shims", note)
    if letters := told["letters_for_ids"]:
        note = ", ".join(f"{letter} is {label}" for label, letter in letters.items())
        yield PackageFact(f"{len(letters)}", "units with a letter for their id", note)
    if loose := told["free_dofs"]:
        note = "in the study; the fixtures hold them in every way: guides are yours to make"
        yield PackageFact(f"{len(loose)}", "held units that are free along or about an axis", note)
    if stiff := told["stiffness_factors"]:
        note = "stiffer or softer: make them so, as the assembly sheet says"
        yield PackageFact(f"{len(stiff)}", "joints that are simulated otherwise than shims", note)
    volume = float(units["volume_mm3"]) / 1000.0
    yield PackageFact(f"{volume:.0f} cm³", "volume of the units", "as if solid")
    yield _pieces(bill, settings)
    route = told["laser_route"]
    how = route.partition(": ")[0].partition(" from ")[0]
    yield PackageFact(how, "units by laser", route)
    prints = total["prints"]
    took, _, needs = prints["note"].partition(", ")
    note = f"{needs} of filament, units and fixtures; by a slicer's standard settings"
    yield PackageFact(took.removeprefix("about "), "print time, estimated", note)


def _pieces(bill: Sequence[Mapping[str, str]], settings: Fabrication) -> PackageFact:
    """Counts sheets and plates by either way to make units and coupon, which are drawn for both."""
    sheets = {
        r["id"]: int(r["count"]) for r in bill if r["item"] == "sheet" and "_nominal" in r["id"]
    }
    plates = [row["id"] for row in bill if row["item"] in {"plate", "fixture"}]
    foil = {file: count for file, count in sheets.items() if not file.startswith(DRAWN_TWICE)}
    fixtures = sum(not file.startswith(DRAWN_TWICE) for file in plates)
    note = "fixtures included, units and coupon printed"
    if settings.laser_cuts_units:
        note += f"; these cut by laser {sum(sheets.values())} / {fixtures}"
    value = f"{sum(foil.values())} / {len(plates)}"
    return PackageFact(value, "sheets to cut / plates to print", note)


def _groups(folder: Path, problem: Problem) -> Iterator[tuple[str, list[Picture]]]:
    colour = COLOURS.get(folder.name, FIXTURE)
    whole = folder / "print/assembled.stl"
    seen = _picture(whole, "the specimen as it is assembled", pictures.assembled(whole, colour))
    yield "The specimen", [seen]
    prebend = read_manifest(folder)["prebend"]
    if any(one["strain"] > STRAIGHT for one in prebend.values()):
        bent = _picture(whole, _BENT, pictures.prebend_map(whole, prebend.values()))
        yield "Shims before any load", [bent]
    yield "Sheets for the laser cutter", list(_sheets(folder))
    yield "Plates for the printer", list(_plates(folder, "print", problem, colour))
    yield "Fixtures", list(_plates(folder, "fixture", problem, FIXTURE))


def _sheets(folder: Path) -> Iterator[Picture]:
    for path in sorted(folder.glob("laser/*_nominal.dxf")):
        kind, number, _ = path.stem.split("_")
        told = f"{kind}, sheet {number.removeprefix('sheet')}, at nominal size"
        yield _picture(path, told, pictures.sheet(path))


def _plates(folder: Path, kind: str, problem: Problem, colour: str) -> Iterator[Picture]:
    for path in sorted(folder.glob(f"{kind}/*.3mf")):
        name, number = path.stem.split("_")
        told = f"{name}, plate {number.removeprefix('plate')}"
        yield _picture(path, told, pictures.plate(path, problem.fabrication.print.bed, colour))


def _picture(path: Path, caption: str, png: bytes) -> Picture:
    folder = path.parent.parent
    file = f"{folder.name}/{path.relative_to(folder).as_posix()}"
    return {"file": file, "caption": caption, "png": base64.b64encode(png).decode("ascii")}
