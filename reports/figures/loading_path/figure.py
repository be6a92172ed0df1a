"""Composes the report along a path: panels with tables, text of the page, animation."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.problem.sections import Paper, single_drives
from reports.base import Table, prose, scale_wide_numbers, style
from reports.facts import JUMPED, Fact, printed
from reports.figures.loading_path import curves, measures, monte_carlo, tables
from reports.figures.loading_path.abscissa import (
    LOADS,
    Abscissa,
    abscissa_of,
    lattice_size,
    structures,
)
from reports.figures.loading_path.drive_response import drive_response
from reports.figures.loading_path.load_legend import LoadLegend
from reports.figures.loading_path.snapshot_grid import SnapshotLayout, snapshots
from reports.figures.loading_path.structure_panels import rest_panel, shade_of
from reports.page import PageText, study_text
from reports.panels import (
    Animation,
    AnimationAxis,
    AnimationClip,
    ColourField,
    Panel,
    PanelFigure,
    case_labels,
    loss_history,
    measured_overlay,
    signed_field,
    structure_clip,
    with_recordings,
)
from reports.study import StudyResults, display_name, undrawn_evaluations

TALLEST_SNAPSHOTS = 116.0
"""Height that all snapshots may take, mm."""
_PROSE = prose(__file__)
_KEYS: tuple[Literal["ux", "uy", "theta"], ...] = ("ux", "uy", "theta")
Curve = tuple[str, Callable[[Axes], None], str, Sequence[Table]]


def loading_path_figure(study: StudyResults) -> PanelFigure:
    """Returns the whole figure."""
    problem, path = study.problem, abscissa_of(study.problem, study.response)
    legend = LoadLegend.of(study)
    grid = SnapshotLayout.of(study, path, TALLEST_SNAPSHOTS - legend.height)
    top = 52.0
    low = top + grid.head + grid.total + 2.0
    colours = shade_of(problem, study.response).field.label.replace("u_y", "u<sub>y</sub>")
    clamped = _PROSE["rest"].format(
        turns=arrows_in_words(study),
        stiffened=_PROSE["stiffened"] if problem.inclusion is not None else "",
        interest=_PROSE["interest"] if problem.objective.region != "surroundings" else "",
    )
    panels = [
        *design_panels(study, clamped),
        Panel(
            ("c", "Response, true to scale", 0.0, top),
            lambda figure: snapshots(figure, study, grid, top + grid.head),
            f"Snapshots at true size, coloured by {colours}.",
        ),
        *_side_by_side(list(_curves(study, path, legend)), low, legend),
    ]
    remark = measured_overlay.caption(study.recordings, grid.recorded) + grid.omission(path)
    return PanelFigure(low + 48.0 + legend.height, panels, study.draft, remark)


def design_panels(
    study: StudyResults, caption: str, overlay: Callable[[Axes], None] | None = None
) -> list[Panel]:
    """Lists panels a, the structures with an `overlay` on each, and b, how the loss fell."""

    def at_rest(figure: Figure) -> None:
        for axes in _at_rest(figure, study):
            if overlay is not None:
                overlay(axes)

    def optimisation(figure: Figure) -> None:
        loss_history(style.place(figure, 133.5, 8.5, 43.5, 31.5), study.design)

    design, history = tables.of_design(study)
    return [
        Panel(("a", "", 0.0, 0.8), at_rest, caption, [design]),
        Panel(("b", "Optimisation", 123.0, 0.8), optimisation, _history(study), [history]),
    ]


def _history(study: StudyResults) -> str:
    """Tells what is drawn of the optimisation, and what is not."""
    before, beside = undrawn_evaluations(study.problem, study.design)
    return str(_PROSE["history"]).format(
        cases=_PROSE["cases"] if _mean([study]) else "",
        before=_PROSE["before"].format(count=before) if before else "",
        beside=_PROSE["beside"].format(count=beside + 1) if beside else "",
    )


def _size(drive: Any) -> str:  # noqa: ANN401  (any drive that has an amplitude)
    """Tells the amplitude of a drive with its symbol and unit."""
    _, symbol, unit, factor = LOADS.get(drive.kind, ("", "$A$", drive.unit, 1.0))
    return f"{symbol} = {printed(f'{factor * drive.amplitude:.4g}', unit)}".replace(" °", "°")


def _at_rest(figure: Figure, study: StudyResults) -> Iterator[Axes]:
    """Yields the structures side by side, and how large and how driven they are."""
    side, names = 40.0, structures(study.response)
    lattice, drives = study.problem.lattice, single_drives(study.problem.drive)
    size = f"{lattice_size(lattice)} units, $s$ = {lattice.spacing:g} mm"
    sizes = [_size(drive) for drive in drives if hasattr(drive, "amplitude")]
    notes = [size, ", ".join(sizes), ""]
    left = (3 - len(names)) * (side + 0.6) / 2
    for k, name in enumerate(names):
        x = left + k * (side + 0.6)
        axes = style.place(figure, x, 6.0, side, side)
        rest_panel(axes, study.problem, study.response, name)
        title, colour = display_name(study.problem, name), style.STRUCTURE_COLOURS[name]
        axes.set_title(title, color=colour, fontsize=style.TITLE, pad=2.0)
        style.write(figure, x + side / 2, 46.6, notes[k], ha="center", fontsize=style.SMALL)
        yield axes


def _curves(study: StudyResults, path: Abscissa, legend: LoadLegend) -> Iterator[Curve]:
    """Titles, curves, sentences and tables of what stands below the snapshots, left to right."""
    problem, measure = study.problem, measures.measure_of(study.problem)

    def of_measure(axes: Axes) -> None:
        curves.measure_panel(axes, study, path, measure, legend.entries)

    way = [Table("path.csv", "every structure along the path", tables.path(study))]
    words = f"{measure.label}{measure.formula}{marks([study])}."
    yield measure.label, of_measure, words, way
    lateral = path.static and measures.contracts_freely(problem, study.response)
    if lateral and problem.objective.target != "rest":
        panel = curves.contraction_panel
        words = _PROSE["contraction"]
        yield "Lateral contraction", lambda axes: panel(axes, study, path), words, ()
    yield _answer(study, path)
    if (copies := study.scatter) is not None:
        end = " at the end of the path" if path.static else ""
        words = _PROSE["copies"].format(end=end, mean=_mean([study]), **_noises([copies]))
        told = "imperfect copies, one a line"
        table = Table("robustness.csv", told, tables.copies(study, copies))
        title = f"{copies['sample'].size} imperfect cloaks"
        spread = curves.robustness_panel
        yield title, lambda axes: spread(axes, study, measure, copies), words, [table]


def _answer(study: StudyResults, path: Abscissa) -> Curve:
    """Returns the curve of what the driven units answer with."""
    response = drive_response(study.problem)
    words = _PROSE[response.key]
    if response.held and path.static and "intact" in structures(study.response):
        words += _PROSE["reaction_error"].format(mean=_mean([study]))
    if path.static:
        words += _PROSE["eigenvalue"].format(least=_PROSE["least"] * bool(_mean([study])))
    if path.displaces and np.isfinite(study.response["snap_load"]).any():
        words += _PROSE["snaps"]
    return response.title, lambda axes: curves.drive_panel(axes, study, path), f"{words}.", ()


def _side_by_side(shown: Sequence[Curve], top: float, legend: LoadLegend) -> Iterator[Panel]:
    """Yields the curves; the first one draws the legend of all below them."""
    width = style.TWO_COLUMNS / len(shown)
    for k, (title, draw, words, data) in enumerate(shown):
        left = k * width

        def placed(figure: Figure, left: float = left, draw: Callable[[Axes], None] = draw) -> None:
            before = len(figure.axes)
            draw(style.place(figure, left + 11.0, top + 11.5, width - 14.0, 27.0))
            for axes in figure.axes[before:]:  # and the one on the right
                scale_wide_numbers(axes)
            if left == 0.0:
                legend.draw(figure, top + 47.0)

        yield Panel(("defg"[k], title, left, top), placed, words, data)


def marks(studies: Sequence[StudyResults]) -> str:
    """Tells what else is drawn with the curves of the measure, each after a semicolon."""
    found = [curves.banded_copies(study) for study in studies]
    banded = _noises([copies for copies in found if copies is not None])
    jumps = any((study.response["stability"] >= JUMPED).any() for study in studies)
    second = any(study.redesign is not None and study.redesign.changed for study in studies)
    shown = {"bands": banded["drawn"], "jumps": jumps, "second": second}
    words = banded | {"mean": _mean(studies)}
    return "".join(_PROSE[name].format_map(words) for name, there in shown.items() if there)


def arrows_in_words(study: StudyResults) -> str:
    """Tells that the directions of a single drive are driven one after another, if several are."""
    alone = len(single_drives(study.problem.drive)) == 1
    return str(_PROSE["turns"]) if alone and _mean([study]) else ""


def _mean(studies: Sequence[StudyResults]) -> str:
    """Tells of what is not drawn by load case that it is a mean; nothing of one load case."""
    several = any(study.response.sizes["case"] > 1 for study in studies)
    return str(_PROSE["mean"]) if several else ""


def _noises(made: Sequence[xr.Dataset]) -> dict[str, str]:
    """Tells of imperfect copies which noises are drawn, and which are not."""
    drawn, others = monte_carlo.noises_in_words(made)
    return {"drawn": drawn, "left": _PROSE["left"].format(others=others) if others else ""}


def loading_path_animation(study: StudyResults) -> Animation:
    """Returns every structure along the path, with its recordings."""
    path, response = abscissa_of(study.problem, study.response), study.response
    clips: list[AnimationClip] = []
    for name in structures(response):
        clip = structure_clip(display_name(study.problem, name), study, name)
        clips += with_recordings(clip, study, name, path.values)
    pad = study.problem.lattice.spacing
    return Animation(axis(path), case_labels(response), clips, fields(study), pad=pad)


def axis(path: Abscissa) -> AnimationAxis:
    """Returns what the slider runs over: once through the path in six seconds."""
    pace = float(path.values[-1] - path.values[0]) / 6.0
    digits = max(0, 3 - int(np.ceil(np.log10(max(path.values[-1], 1e-9)))))
    symbol = path.symbol.strip("$")
    speeds = {"once in 6 s": pace, "3 s": 2 * pace, "12 s": pace / 2}
    return AnimationAxis(symbol, path.unit, path.values, digits, not path.static, speeds)


def fields(study: StudyResults) -> list[ColourField]:
    """Lists what may colour the units; that of the figure first."""
    first = shade_of(study.problem, study.response).field
    motion = study.response["displacement"].values
    return [first, *(signed_field(key, motion) for key in _KEYS if key != first.key)]


def loading_path_text(study: StudyResults, caption: str, facts: Sequence[Fact]) -> PageText:
    """Returns what the page says of itself."""
    key = measures.measure_of(study.problem).key
    measured = (f"{key}_altered", f"{key}_cloaked", f"{key}_cloaked_copies")
    return study_text(
        study,
        caption,
        facts,
        credit=credit(study.problem.report.paper),
        headline=(f"{key}_reduction", *measured, "loss_reduction", "snaps"),
    )


def credit(paper: Paper | None) -> str:
    """Tells which figure of the paper a study follows, and with which of its values."""
    source = ""
    if paper is not None:
        variant = f" Run with its values: {paper.variant}." if paper.variant else ""
        source = _PROSE["after"].format(figure=paper.figure, variant=variant)
    return source + _PROSE["computed"]
