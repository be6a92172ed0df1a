"""Makes the index page: figures, the paper's claims, files, provenance, how to cite."""

import argparse
import base64
import json
import logging
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cv2

from pipeline.datasets import git_commit, package_versions
from pipeline.runtime import UserError
from reports.facts import claims
from reports.page import citation, write_page
from reports.products.index import inventory
from reports.products.index.inventory import BuiltReport, Link

LOG = logging.getLogger(__name__)

WIDTH = 560
"""Of a thumbnail in pixels."""
LARGEST_MOVIES = 12_000_000
"""Bytes of all movies that the page holds itself."""
PROOFS = {
    "benchmark": "run time against error",
    "stress": "attempts to break the numbers",
    "survival": "attempts to lose results",
}
"""Pages beside those of the studies, by folder."""


def report(args: argparse.Namespace) -> None:
    """Makes the page that a command line asks for."""
    write_page(args.results / "index.html", "index.html.j2", shown(args.results))


def shown(results: Path) -> dict[str, Any]:
    """Returns what the index of a folder of results shows."""
    faults: list[UserError] = []
    built = inventory.reports(results, faults)
    for fault in faults:
        LOG.error("left out: %s", fault)
    return {
        "faults": [f"{_below(results, fault)}: {fault.what}" for fault in faults],
        "title": "Nonlinear mechanical metamaterial cloaks",
        "figures": [(each, thumbnail(each.picture)) for each in built if each.figure],
        "others": [(each, thumbnail(each.picture)) for each in built if not each.figure],
        "tables": tables(built),
        "source": claims.listed().source,
        "movies": movies(results),
        "proofs": proofs(results),
        "datasets": [each for study in built for each in study.datasets],
        "made": _made(),
        "citations": citation.citations(),
    }


def _below(results: Path, fault: UserError) -> str:
    file = Path(fault.file or "")
    return file.relative_to(results).as_posix() if file.is_relative_to(results) else file.name


def tables(built: Sequence[BuiltReport]) -> list[dict[str, Any]]:
    """Returns the claims by figure, of those that are built and of those that are not (None)."""
    by_name = {each.name: each for each in built}
    made: list[dict[str, Any]] = []
    for name in dict.fromkeys(claim.study for claim in claims.listed().claims):
        own = by_name.get(name)
        judged = claims.assessed(name, own.facts if own else [])
        label = own.label if own else ""
        made.append(
            {
                "name": name,
                "title": f"Figure {name.removeprefix('fig')}",
                "built": own,
                "claims": judged,
                "verdict": claims.verdict(judged, label),
                "synthetic": label,
            }
        )
    return made


def movies(results: Path) -> list[tuple[Link, str]]:
    """Lists all movies, with their bytes as base64 where the page has room, the smallest first."""
    links = inventory.others(results, "movies", "*.mp4")
    files = {link.address: (results / link.address).read_bytes() for link in links}
    held, room = set(), LARGEST_MOVIES
    for address in sorted(files, key=lambda each: len(files[each])):
        room -= len(files[address])
        if room >= 0:
            held.add(address)
    return [(link, _base64(files[link.address]) if link.address in held else "") for link in links]


def proofs(results: Path) -> list[Link]:
    """Pages on what the numbers rest on, and the files of benchmarks."""
    pages = [
        Link(page.address, text)
        for folder, text in PROOFS.items()
        for page in inventory.others(results, folder, "index.html")
    ]
    named = {page.address for page in pages}
    data = inventory.others(results, "benchmark", "*.*")
    return [*pages, *(link for link in data if link.address not in named)]


def thumbnail(picture: Path) -> str:
    """Returns a picture made small, as base64 of a JPEG; empty where there is none."""
    image = cv2.imread(str(picture), cv2.IMREAD_COLOR)
    if image is None:
        return ""
    rows = round(image.shape[0] * WIDTH / image.shape[1])
    small = cv2.resize(image, (WIDTH, rows), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 86])
    return _base64(data.tobytes())


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _made() -> list[tuple[str, Any]]:
    packages = dict(package_versions()) | {name: version(name) for name in ("jinja2", "matplotlib")}
    return [("git_commit", git_commit()), ("packages", json.dumps(packages, sort_keys=True))]
