"""The page of Figure 2: its words and its animation."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from pipeline.problem import canonical_json, content_hash
from reports import measures, style
from reports.facts import Fact, worded
from reports.fig2.facts import MONITORED
from reports.page import Page, Source, source
from reports.player import Axis, Clip, Disc, Field, payload, quantisation_error
from reports.scene import Scene
from reports.structure import DRIVEN, from_dataset, middle_of_top_edge
from reports.study import Study
from reports.tables import Table

HEADLINE = ("mean_reduction", "loss_end", "peak_to_peak_reduction", "map_max")

CAPTION = (
    "<b>a</b> Reference, altered and cloaked structures; hatched pads clamp the corners, the arrow "
    "is the drive, the dashed circle bounds the cloak. "
    "<b>b</b> Loss against evaluation: mean over the load angles (thick) and each angle (thin); "
    "rejected evaluations are dots, infeasible ones pale, circles the best feasible designs. "
    "<b>c</b> Snapshots over the last drive cycle at true size, coloured by |U|. "
    "<b>d</b> Vertical displacement of the middle unit of the top edge; dots mark the snapshots. "
    "<b>e</b> Loss over loading angle and frequency; stars mark the loads designed for."
)


def animation(scene: Scene, response: xr.Dataset) -> dict[str, Any]:
    """The player's data: altered and cloaked structures under every load."""
    clips = []
    for name in ("altered", "cloaked"):
        part = response.sel(structure=name)
        structure = from_dataset(part, scene.spacing)
        motion = part["displacement"].transpose("case", "time", "unit", "dof").values
        colour, marker = style.STRUCTURE_COLOURS[name], middle_of_top_edge(structure)
        clips.append(Clip(name.capitalize(), colour, structure, motion, marker))
    angles = [f"α = {angle:g}°" for angle in response["direction"].values]
    speeds = {"¼ of real time": 0.25, "⅛": 0.125, "½": 0.5, "real time": 1.0}
    axis = Axis("t", "s", response["time"].values, 3, True, speeds)
    discs = [Disc(*scene.middle, radius, style.CLOAKED) for radius in scene.radii]
    start = measures.nearest_case(response, MONITORED)
    fields = _fields(scene, clips)
    return payload(axis, angles, clips, fields, discs, start=start, pad=scene.spacing)


def _fields(scene: Scene, clips: Sequence[Clip]) -> list[Field]:
    others = clips[0].structure.support != DRIVEN
    motion = np.concatenate([clip.motion[:, :, others] for clip in clips])
    size = float(np.nanmax(np.linalg.norm(motion / scene.scale, axis=-1)))
    rise, turn = (float(np.nanmax(np.abs(motion[..., k]))) for k in (1, 2))
    scale = (scene.spacing, scene.spacing, 1.0)
    degrees = 180.0 / np.pi
    rise, turn = _round_up(rise), _round_up(degrees * turn)
    return [
        Field("norm", "|U|", "", 1.0, "magnitude", (0.0, _round_up(size)), scale),
        Field("uy", "u_y", "mm", 1.0, "signed", (-rise, rise)),
        Field("theta", "θ", "°", degrees, "signed", (-turn, turn)),
    ]


def _round_up(value: float) -> float:
    """The next value of one significant digit, or two where the first is 1."""
    if value <= 0:
        return 1.0
    step = 10.0 ** np.floor(np.log10(value))
    step = step / 10.0 if value / step < 2.0 else step
    return float(np.round(np.ceil(value / step - 1e-9) * step, 12))


def build(
    study: Study,
    facts: Sequence[Fact],
    tables: Sequence[Table],
    svg: str,
    figure_files: Sequence[str],
) -> Page:
    """The page of a study, of which everything else has been made."""
    scene = study.scene
    player = animation(scene, study.response)
    by_key = {fact.key: fact for fact in facts}
    return Page(
        title=scene.title,
        lead=study.problem.doc.strip(),
        credit=(
            "After Figure 2 of Bordiga et al., “Nonlinear mechanical metamaterial cloaks”; every "
            "number here is computed from the datasets."
        ),
        figure_title="Shielding dynamic excitations",
        caption=CAPTION,
        svg=svg,
        figure_files=figure_files,
        headline=[by_key[key] for key in HEADLINE],
        facts=facts,
        tables=tables,
        player=player,
        player_note=_player_note(player),
        provenance=_provenance(study),
        problem=json.dumps(
            json.loads(canonical_json(study.problem)), indent=1, sort_keys=True, ensure_ascii=False
        ),
        skipped=_skipped(study.response),
        draft=study.draft,
    )


def _player_note(player: Mapping[str, Any]) -> str:
    shift, turn = quantisation_error(player)
    shown, saved = player["axis"]["shown"], player["axis"]["saved"]
    return (
        f"{shown} of {saved} saved times, rounded to ±{worded(shift, 'mm', 1)} and "
        f"±{worded(turn, 'rad', 1)}; between them the motion is interpolated. The dot marks the "
        "unit of panel d."
    )


def _skipped(response: xr.Dataset) -> list[str]:
    """What the simulation left out, each with the structures that it holds for."""
    plans = json.loads(response.attrs["plan"])
    names: dict[str, list[str]] = {}
    for structure, plan in plans.items():
        for text in plan["skipped"]:
            names.setdefault(text, []).append(structure)
    everywhere = len(plans)
    return [
        text if len(found) == everywhere else f"{text} ({', '.join(found)})"
        for text, found in names.items()
    ]


def _provenance(study: Study) -> list[Source]:
    packages = {name: version(name) for name in ("jinja2", "matplotlib", "numpy", "xarray")}
    made = {
        "problem_hash": content_hash(study.problem),
        "datasets": json.dumps(study.files),
        "packages": json.dumps(packages),
    }
    own = source("this page", xr.Dataset(attrs=made))
    return [own, *(source(f"{name}.nc", data) for name, data in study.datasets.items())]
