"""Checks a package before anyone gets to see it; its assembly sheet and its manifest here."""

import base64
import re
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import xarray as xr

from pipeline.datasets import file_hash
from pipeline.fabrication.checks.assembled_specimen import check_assembled, unit_sections
from pipeline.fabrication.checks.bill_checks import check_bill
from pipeline.fabrication.checks.laser_folder import check_laser
from pipeline.fabrication.checks.package_record import PackageRecord, expected_parts
from pipeline.fabrication.checks.print_folder import check_fixtures, check_print
from pipeline.fabrication.papers import MANIFEST, read_manifest
from pipeline.fabrication.readback import BUG, Fault, read_stl, stop, unreadable
from pipeline.problem.sections import Fabrication

STEPS = 6
"""Number of calls of `done` by `check_package`."""
_STREAM = re.compile(rb"stream\r?\n(.*?)endstream", re.DOTALL)
_SHOWN = re.compile(rb"\(((?:[^()\\]|\\.)*)\)\s*Tj")
_ESCAPED = re.compile(r"\\(.)")


def check_package(
    folder: Path,
    design: xr.Dataset,
    structure: str,
    settings: Fabrication,
    pictures: Path,
    done: Callable[[], object] = lambda: None,
) -> None:
    """Reads every file of a package back and stops at faults.

    Args:
        folder: the package.
        design: the dataset that it was made of.
        structure: intact, altered or cloaked.
        settings: of the fabrication.
        pictures: folder for pictures of faults; made only if there are any.
        done: called after each of the STEPS.

    Raises:
        UserError: the first fault, with its unit, the parameter to change and a picture.
    """
    expected = expected_parts(design, structure)
    assembled = read_stl(folder / "print/assembled.stl")
    shapes = unit_sections(assembled, expected, settings)
    manifest = read_manifest(folder)
    told = dict(manifest["letters_for_ids"]), manifest["drives"]
    record = PackageRecord(folder, expected, shapes, settings, *told)
    faults = list(check_assembled(assembled, record))
    done()
    for check in (check_print, check_laser, check_fixtures, check_bill, check_papers):
        faults += check(record)
        done()
    stop([replace(fault, file=fault.file.relative_to(folder)) for fault in faults], pictures)


def check_papers(record: PackageRecord) -> Iterator[Fault]:
    """Checks papers: ids are unique and on the plan, every file is in the manifest."""
    folder, letters = record.folder, record.letters
    where, sheet = folder / MANIFEST, folder / "assembly.pdf"
    carried = Counter(letters.get(label, label) for label in record.expected.polygons)
    for words, count in carried.items():
        if count > 1:
            yield Fault(f"unit {words}", f"{count} units carry this", "labels", BUG, where)
    shown = {text for page in page_words(sheet) for text in page}
    for label in sorted(record.expected.polygons):
        if (f"{label}={letters[label]}" if label in letters else label) not in shown:
            what = "it is not on the assembly sheet"
            yield Fault(f"unit {label}", what, "labels", BUG, sheet)
    paths = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*")}
    files = {n: file_hash(path) for n, path in paths.items() if path.is_file() and path != where}
    listed = read_manifest(folder)["files"]
    for name in sorted(files.keys() ^ listed.keys()):
        yield Fault("the manifest", f"{name} is not in it, or not there", "laser", BUG, where)
    for name in sorted(files.keys() & listed.keys()):
        if files[name] != listed[name]:
            yield Fault("the manifest", f"{name} is another file than listed", "laser", BUG, where)


def page_words(path: Path) -> list[list[str]]:
    """Reads the pieces of text on each page of a PDF, in the order in which they are shown.

    Raises:
        UserError: it is no PDF, or has no text.
    """
    try:
        content = path.read_bytes()
        pages = [_texts(stream.strip()) for stream in _STREAM.findall(content)]
    except (OSError, ValueError, zlib.error) as error:
        raise unreadable("the assembly sheet", path, error) from error
    if not content.startswith(b"%PDF") or b"%%EOF" not in content[-32:] or not any(pages):
        raise unreadable("the assembly sheet", path, "it is not whole")
    return [page for page in pages if page]


def _texts(stream: bytes) -> list[str]:
    """Unpacks a page's operators, which reportlab packs with Flate and then in base 85."""
    if stream.endswith(b"~>"):
        stream = base64.a85decode(stream.removesuffix(b"~>"))
    shown = _SHOWN.findall(zlib.decompress(stream))
    return [_ESCAPED.sub(r"\1", text.decode("cp1252")) for text in shown]
