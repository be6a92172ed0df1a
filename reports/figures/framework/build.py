"""Builds Figure 1, the framework, from the geometry and the motion of a shaken study."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.runtime import cli
from reports.base import style
from reports.figures.framework import figure
from reports.page import citation, publishing, study_page, templating
from reports.panels import measured_overlay

if TYPE_CHECKING:
    from reports.study import StudyResults

NAME = "fig1"
TITLE = "Design framework for nonlinear mechanical cloaks"
CAPTION = (
    "<b>a</b> A reference lattice and an altered one, in which a cloak (purple) is to undo the "
    "alteration in the region of interest (blue): a loss measures how far the two responses are "
    "apart there, and falls as the cloak’s geometry follows the gradient that a differentiable "
    "simulation of the full nonlinear dynamics gives. The curves are those of the study itself. "
    "<b>b</b> Two units of its lattice: three degrees of freedom each, a ligament that stretches, "
    "shears and bends, and contact as a void closes. <b>c</b> Cloaks shield their surroundings "
    "from an excitation, or conceal what was cut out. <b>d</b> The optimised cloak, what is cut "
    "of it, its units as a camera finds them (cyan outlines; orange: how far they moved), and the "
    "motion of the middle unit of the top edge, without the cloak (orange) and with it (purple)."
)


def publish(study: StudyResults, folder: Path) -> list[Path]:
    """Figure and page of the framework in `folder`; returns the paths of its files, page last.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    return publishing.published(lambda aside: _written(study, aside), folder)


def _written(study: StudyResults, folder: Path) -> list[Path]:

    with style.styled():
        drawn = style.save(figure.draw_framework(study), folder / NAME)
    values = {
        "title": TITLE,
        "caption": CAPTION + measured_overlay.caption(study.recordings),
        "svg": templating.inlined((folder / f"{NAME}.svg").read_text(encoding="utf-8")),
        "files": [path.name for path in drawn],
        "datasets": [f"../../{study.target}/{name}" for name in study.files],
        "study": study.target,
        "provenance": study_page.provenance(study),
        "citations": citation.citations(),
    }
    page = folder / "index.html"
    page.write_text(templating.rendered("plate.html.j2", values), encoding="utf-8")
    return [*drawn, page]


def _work(args: argparse.Namespace) -> None:
    from reports.study import study_results as study

    shown = [file.parent.name for file in args.comparisons]
    publish(study.built(args.problem, args.preset, args.results, shown), args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the figure; returns the exit code."""
    parser = cli.parser("reports.figures.framework.build", str(__doc__))
    parser.add_argument(
        "--results", type=Path, required=True, metavar="FOLDER", help="where its datasets are"
    )
    parser.add_argument(
        "--comparisons", type=Path, nargs="*", default=(), metavar="NC",
        help="its recordings beside their simulation",
    )  # fmt: skip
    parser.add_argument(
        "--out-dir", type=Path, required=True, metavar="FOLDER", help="the figure's folder"
    )
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
