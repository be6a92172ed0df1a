"""Lists what has been built below a folder of results: reports, datasets, packages.

Only what is there counts; nothing of the problems is read, so the index is of these very files.
"""

import html
import os
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from pipeline.datasets import SYNTHETIC_LABEL, file_hash, read_attributes
from pipeline.runtime import UserError
from reports.facts import Fact
from reports.facts import fact_records as facts

FIGURE = re.compile(r"fig\d+")
"""Names of the studies that are figures of the paper."""
PRODUCTS = {
    "fabrication": "fabrication files",
    "sweep": "sweep",
    "spectrum": "spectrum",
    "gains": "gains of robust designs",
    "certificate": "losses over a family of loads",
    "front": "cost of holding against any load",
}
"""Pages of a study beside its report, by folder."""


SEAL = re.compile(r'<meta name="facts-sha256" content="(\w+)">')
_DAMAGED = (OSError, ValueError, TypeError, LookupError, AttributeError)
T = TypeVar("T")


@dataclass(frozen=True)
class Link:
    """Describes a file, as seen from the folder of results; `note` tells more of it."""

    address: str
    text: str
    note: str = ""


@dataclass(frozen=True)
class BuiltDataset:
    """Tells where a dataset is from: its file's hash, and what it says of itself."""

    address: str
    sha256: str
    commit: str
    problem: str
    synthetic: bool


@dataclass(frozen=True)
class BuiltReport:
    """Describes one report, with what lies around it."""

    name: str
    title: str
    draft: bool
    page: Link
    picture: Path
    facts: list[Fact]
    files: list[Link]
    datasets: list[BuiltDataset]

    @property
    def figure(self) -> bool:
        """Tells whether it is a figure of the paper, and not a variant or another study."""
        return FIGURE.fullmatch(self.name) is not None

    @property
    def label(self) -> str:
        """Marks a report whose experiment was rendered; empty of any other."""
        return SYNTHETIC_LABEL if any(each.synthetic for each in self.datasets) else ""


def reports(results: Path, faults: list[UserError] | None = None) -> list[BuiltReport]:
    """Returns all reports in `results`: the paper's figures first, then others, by name.

    What is damaged or another study's is left out, and appended to ``faults``.
    """
    told = [] if faults is None else faults
    found: list[BuiltReport] = []
    for page in sorted(results.glob("*/report/index.html")):
        found += _readable([page], lambda page: _built(page, results, told), told)
    return sorted(found, key=lambda built: (not built.figure, built.draft, built.name))


def others(results: Path, folder: str, pattern: str) -> list[Link]:
    """Returns files of a folder of results, by name."""
    paths = sorted((results / folder).glob(pattern))
    return [Link(_seen(path, results), path.name) for path in paths]


def _readable(files: Iterable[Path], read: Callable[[Path], T], faults: list[UserError]) -> list[T]:
    """Reads files, and appends to ``faults`` why some cannot be."""
    found = []
    for file in files:
        try:
            found.append(read(file))
        except UserError as error:
            faults.append(error)
        except _DAMAGED as error:
            remedy = "build it again"
            faults.append(UserError(f"damaged: {type(error).__name__}", file=file, remedy=remedy))
    return found


def _built(page: Path, results: Path, faults: list[UserError]) -> BuiltReport:
    name = page.parent.parent.name
    text = page.read_text(encoding="utf-8")
    sealed = SEAL.search(text)
    title = re.search(r"<title>(.*?)</title>", text)
    known = page.parent / "facts.json"
    shown = _datasets(page, text)
    folders = dict.fromkeys(file.parent for file in shown)
    return BuiltReport(
        name=name,
        title=html.unescape(title[1]) if title else name,
        draft='class="draft"' in text,
        page=Link(_seen(page, results), "page"),
        picture=page.parent / f"{name.partition('@')[0]}.png",
        facts=[
            fact
            for each in _readable([known] if known.is_file() else [], _facts(sealed), faults)
            for fact in each
        ],
        files=[
            *(Link(_seen(file, results), file.name) for file in sorted(page.parent.glob("*.pdf"))),
            *(link for folder in folders for link in _around(folder, results, faults)),
        ],
        datasets=_readable(shown, lambda file: _dataset(file, results), faults),
    )


def _facts(sealed: re.Match[str] | None) -> Callable[[Path], list[Fact]]:
    def read(file: Path) -> list[Fact]:
        if sealed is None or sealed[1] != file_hash(file):
            what = "not what was written, or not of the page beside it"
            raise UserError(what, file=file, remedy="build the report again")
        return facts.read_json(file)

    return read


def _datasets(page: Path, text: str) -> list[Path]:
    """Returns the datasets that a page links to, as far as they are there."""
    addresses = re.findall(r'href="([^":]*\.nc)"', text)
    files = (Path(os.path.normpath(page.parent / address)) for address in addresses)
    return [file for file in files if file.is_file()]


def _around(folder: Path, results: Path, faults: list[UserError]) -> list[Link]:
    """Lists what is built of a study, and its recordings, with whether they were filmed."""
    found = [
        Link(_seen(page, results), text)
        for product, text in PRODUCTS.items()
        if (page := folder / product / "index.html").is_file()
    ]
    pages = sorted(folder.glob("recordings/*/index.html"))
    return found + _readable(pages, lambda page: _recording(page, results), faults)


def _recording(page: Path, results: Path) -> Link:
    track = read_attributes(page.parent / "track.nc")
    note = SYNTHETIC_LABEL if track["synthetic"] == "yes" else ""
    return Link(_seen(page, results), f"recording “{page.parent.name}”", note)


def _dataset(file: Path, results: Path) -> BuiltDataset:
    found = read_attributes(file)
    about = {key: str(found.get(key, "")) for key in ("git_commit", "problem_hash")}
    return BuiltDataset(
        address=_seen(file, results),
        sha256=file_hash(file),
        commit=about["git_commit"],
        problem=about["problem_hash"],
        synthetic=found.get("synthetic") == "yes",
    )


def _seen(path: Path, results: Path) -> str:
    return path.relative_to(results).as_posix()
