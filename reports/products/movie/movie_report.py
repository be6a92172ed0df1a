"""Makes a movie of one or several studies, one after another, with their recordings."""

import argparse
from collections.abc import Iterator, Sequence

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.problem.sections import Codec
from pipeline.runtime import cli
from pipeline.virtual_lab import encode_video
from reports.figures import kinds
from reports.products.movie.frames import RATE, images
from reports.study import StudyResults, study_results
from sim.core import Image


def report(args: argparse.Namespace) -> None:
    """Makes the movie that a command line asks for."""
    studies = []
    for path in args.problems:
        name = path.resolve().parent.name
        folder = args.results / name / "recordings"
        shown = [file.parent.name for file in args.comparisons if file.parent.parent == folder]
        studies.append(study_results.load_built(path, None, args.results, shown))
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
        return f"{SYNTHETIC_LABEL}: what is called experiment was rendered and tracked, not filmed."
    return ""
