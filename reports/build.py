"""Builds the report of a study: figure (PDF, SVG, PNG), page, facts and data tables.

The files are made in a folder beside the wanted one and moved in when all of them are whole, so
that a reader never meets half a report. The same datasets give the same bytes.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from collections.abc import Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline import cli
from pipeline.errors import refusal

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pipeline.problem import Output
    from reports.study import Study

REQUIRED: tuple[Output, ...] = ("design", "response")
OPTIONAL: tuple[Output, ...] = ("sweep", "scatter", "verification")


def publish(study: Study, folder: Path) -> list[Path]:
    """Make the report aside and move its files into `folder`, the page last.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with _aside(folder) as aside:
            return [_moved(path, folder) for path in write_report(study, aside)]
    except OSError as error:
        raise refusal(folder, error) from error


def write_report(study: Study, folder: Path) -> list[Path]:
    """Write all files of the report into an existing `folder`; returns their paths, page last."""
    from reports import facts, kinds, page, style

    kind = kinds.of(study.problem)
    known = facts.quoted(kind.facts(study), study.problem.report.paper)
    facts.write_json(known, folder / "facts.json")
    data = [facts.table(known), *kind.tables(study)]
    for table in data:
        (folder / table.name).write_bytes(table.csv)
    with style.styled():
        drawn = style.save(kind.figure(study), folder / study.name)
    svg = (folder / f"{study.name}.svg").read_text(encoding="utf-8")
    html = page.render(kind.page(study, known, data, svg, [path.name for path in drawn]))
    (folder / "index.html").write_text(html, encoding="utf-8")
    names = ["facts.json", *(table.name for table in data), "index.html"]
    return [*drawn, *(folder / name for name in names)]


@contextmanager
def _aside(folder: Path) -> Iterator[Path]:
    """An empty folder beside `folder`, gone at the end; what a killed build left there goes too."""
    aside = folder.with_name(f".{folder.name}.part")
    if aside.exists():
        shutil.rmtree(aside)
    aside.mkdir()
    try:
        yield aside
    finally:
        shutil.rmtree(aside)


def _moved(path: Path, folder: Path) -> Path:
    """The file in `folder`, safe on the disk before it shows under its name."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
    return path.replace(folder / path.name)


def _work(args: argparse.Namespace) -> None:
    from reports import study

    given: dict[Output, Path] = {
        name: path for name in (*REQUIRED, *OPTIONAL) if (path := getattr(args, name)) is not None
    }
    publish(study.load(args.problem, args.preset, given), args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the report; returns the exit code."""
    parser = cli.parser("reports.build", str(__doc__))
    for name in (*REQUIRED, *OPTIONAL):
        parser.add_argument(
            f"--{name}",
            type=Path,
            required=name in REQUIRED,
            metavar="NC",
            help=f"the {name} dataset" + ("" if name in REQUIRED else ", if the problem has one"),
        )
    parser.add_argument(
        "--out-dir", type=Path, required=True, metavar="FOLDER", help="the report's folder"
    )
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
