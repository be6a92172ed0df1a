"""Builds the page that shows what is built of a study: sheets, plates, specimens.

It reads the packages and nothing else of the study's results, so a picture shows a file and not
what the file was meant to be. The same packages give the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline import problem
from pipeline.problem import Problem
from pipeline.runtime import cli, refusal
from reports.page import templating
from reports.products.fabrication import content, pictures


def render(asked: Problem, folders: Sequence[Path], done: cli.progress | None = None) -> str:
    """HTML of the page.

    Args:
        asked: the problem.
        folders: the packages, one a structure.
        done: the progress to tell of each package.
    """
    made = []
    for folder in folders:
        made.append(content.package(folder, asked))
        if done is not None:
            done.update()
    values = {
        "title": f"{asked.title}: what is built",
        "lead": "Drawings for the laser cutter, plates for the printer, fixtures and papers.",
        "pens": [(name, colour) for name, colour in pictures.PENS.items() if name != "REFERENCE"],
        "structures": made,
        "parameters": list(content.parameters(asked.fabrication.model_dump(mode="json"))),
    }
    return templating.rendered("fabrication.html.j2", values)


def _work(args: argparse.Namespace) -> None:
    asked = problem.load(args.problem, args.preset)
    with cli.progress(len(args.packages), "pictures of fabrication") as bar:
        page = render(asked, args.packages, bar)
    aside = args.out.with_name(f".{args.out.name}.part")
    try:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        aside.write_text(page, encoding="utf-8", newline="\n")
        aside.replace(args.out)
    except OSError as error:
        raise refusal(args.out, error) from error
    finally:
        aside.unlink(missing_ok=True)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the page; returns the exit code."""
    parser = cli.parser("reports.products.fabrication.build", str(__doc__))
    parser.add_argument(
        "--packages", type=Path, nargs="+", required=True, metavar="FOLDER", help="the packages"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="HTML", help="the page")
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
