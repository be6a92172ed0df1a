"""Builds a movie of one or several studies, one after another, with their recordings.

The same datasets give the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.problem.sections import Codec
from pipeline.runtime import cli
from pipeline.virtual_lab import encode_video
from reports.figures import kinds
from reports.products.movie.frames import RATE, images
from reports.study import LABEL
from sim.core import Image

if TYPE_CHECKING:
    from reports.study import StudyResults


def _work(args: argparse.Namespace) -> None:
    from reports.study import study_results as study

    studies = []
    for path in args.problems:
        name = path.resolve().parent.name
        folder = args.results / name / "recordings"
        shown = [file.parent.name for file in args.comparisons if file.parent.parent == folder]
        studies.append(study.built(path, None, args.results, shown))
    labels = {"title": args.out.stem, "comment": _note(studies)}
    with cli.progress(len(studies), "movie") as bar:
        frames = _frames(args.out.stem, studies, bar)
        encode_video(args.out, frames, RATE, Codec(crf=26), labels)


def _frames(name: str, studies: Sequence[StudyResults], bar: cli.progress) -> Iterator[Image]:

    for study in studies:
        reel = kinds.kind_of(study.problem).animation(study)
        title = f"Movie {name}: {study.problem.title or study.name}"
        yield from images(reel, title, _note([study]))
        bar.update()


def _note(studies: Sequence[StudyResults]) -> str:

    if any(each.synthetic for study in studies for each in study.recordings):
        return f"{LABEL}: what is called experiment was rendered and tracked, not filmed."
    return ""


def main(argv: Sequence[str] | None = None) -> int:
    """Build the movie; returns the exit code."""
    parser = cli.parser("reports.products.movie.build", str(__doc__), study=False)
    parser.add_argument(
        "--problems", type=Path, nargs="+", required=True, metavar="YAML", help="the studies"
    )
    parser.add_argument(
        "--results", type=Path, required=True, metavar="FOLDER", help="where their datasets are"
    )
    parser.add_argument(
        "--comparisons", type=Path, nargs="*", default=(), metavar="NC",
        help="their recordings beside their simulation",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, metavar="MP4", help="the movie")
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
