"""Converts YAML descriptions of test videos to a recording and a design dataset."""

from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import xarray as xr
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from pipeline.problem.fields import fault
from pipeline.problem.reading import explain_error, yaml_file
from pipeline.runtime import UserError
from pipeline.tracking.frames.picture_folder import has_pictures
from pipeline.tracking.frames.video import VIDEOS, declared_rate, rendered
from sim.core import Floats, Ints

_REQUIRED = {"name", "grid", "spacing_mm", "ligament_gap_mm", "bias_angle_deg"}
_SAME_RATE = 0.03  # relative difference up to which a file's own times are kept


class _VideoDescription(BaseModel):
    """Checks what is taken from a description; ignores the rest."""

    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)

    name: str
    kind: str = ""
    grid: Annotated[list[Annotated[int, Field(ge=1, le=1000)]], Field(min_length=2, max_length=2)]
    spacing_mm: Annotated[float, Field(gt=0.0)]
    ligament_gap_mm: Annotated[float, Field(gt=0.0)]
    bias_angle_deg: Annotated[float, Field(gt=-45.0, lt=45.0)]
    approx_px_per_mm: Annotated[float, Field(gt=0.0)] | None = None
    fps: Annotated[float, Field(gt=0.0)] | None = None

    @model_validator(mode="after")
    def _has_units_and_ligaments(self) -> Self:
        if self.grid == [1, 1]:
            raise fault("a single unit has no ligaments", "give columns and rows of units", "grid")
        gap, spacing = self.ligament_gap_mm, self.spacing_mm
        if gap >= spacing:
            what = f"no unit is left between gaps of {gap:g} mm, {spacing:g} mm apart"
            raise fault(what, "keep the gap below `spacing_mm`", "ligament_gap_mm")
        return self


def description(path: Path) -> dict[str, Any]:
    """Reads the description of a video.

    Raises:
        UserError: not such a description.
    """
    document = yaml_file.read_yaml(path)
    data = document.data
    missing = sorted(_REQUIRED - data.keys())
    if missing:
        raise UserError(
            f"not a description of a test video: it lacks {', '.join(missing)}",
            file=path,
            remedy="give a YAML with the grid of the specimen, or write a recording by hand",
        )
    try:
        _VideoDescription.model_validate(data)
    except ValidationError as error:
        raise explain_error(error, document, data, None) from error
    return data


def video_of(path: Path) -> Path:
    """Finds the video beside its description, or the folder of pictures of that name.

    Raises:
        UserError: there is none.
    """
    beside = [one for one in sorted(path.parent.iterdir()) if one.stem == path.stem]
    for suffix in VIDEOS:
        if video := next((one for one in beside if one.suffix.lower() == suffix), None):
            return video
    bare = path.with_suffix("")
    if bare.is_file() or (bare.is_dir() and has_pictures(bare)):
        return bare
    raise UserError("no video beside it", file=path, remedy="name it with --video")


def recording_text(described: dict[str, Any], video: Path, design: str) -> str:
    """Writes the recording's YAML; without a word on it, the file tells whether it is synthetic."""
    lines = [
        f"title: {described.get('kind', described['name'])!r}",
        f"video: {str(video)!r}",
        f"design: {design}",
        f"synthetic: {str(described.get('synthetic', rendered(video))).lower()}",
    ]
    if scale := described.get("approx_px_per_mm"):
        lines.append(f"pixel_size: {1 / scale:.4g} mm")
    if rate := described.get("fps"):
        own = declared_rate(video)
        if own is None:
            lines.append(f"frame_rate: {rate:g} Hz")
        elif abs(rate / own - 1) > _SAME_RATE:
            lines.append(
                f"frame_rate: {rate:g} Hz # as described; the file itself has {own:.4g} Hz"
            )
    return "\n".join(lines) + "\n"


def design(described: dict[str, Any]) -> xr.Dataset:
    """Makes the specimen a design without history.

    Units are turned by +bias where i + j is even: the mirror image of the lattices of this
    project. Ids count i + columns j and the origin is unit (0, 0), as everywhere here.
    """
    columns, rows = described["grid"]
    spacing, gap = float(described["spacing_mm"]), float(described["ligament_gap_mm"])
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(columns), np.arange(rows)))
    slope = np.where((i + j) % 2 == 0, 1.0, -1.0) * np.tan(np.deg2rad(described["bias_angle_deg"]))
    right = (spacing - gap) / 2 * np.stack([np.ones_like(slope), slope], axis=1)
    top = np.stack([-right[:, 1], right[:, 0]], axis=1)
    centre = np.stack([i, j], axis=1) * spacing
    vertices = centre[:, None] + np.stack([right, top, -right, -top], axis=1)
    joint, corner = _ligaments(columns, rows)
    units = len(centre)
    zeros = np.zeros(units, np.int8)
    variables = {
        "region": (("unit",), zeros),
        "roi": (("unit",), zeros),
        "support": (("unit",), zeros),
        "ligament_unit": (("ligament", "end"), joint),
        "ligament_vertex": (("ligament", "end"), corner),
        "end_angles": (("ligament", "end"), np.full(corner.shape, np.nan)),
        "vertices": (("unit", "vertex", "xy"), vertices),
        "vertices_initial": (("unit", "vertex", "xy"), vertices),
        "centroid": (("unit", "xy"), centre),
        "smallest_gap": ((), _smallest_gap(vertices, joint)),
        "overlaps": ((), 0),
        **_empty_history(),
    }
    coordinates = {
        "unit": (("unit",), np.arange(units)),
        "i": (("unit",), i),
        "j": (("unit",), j),
        "xy": (("xy",), ["x", "y"]),
        "direction": (("case",), [0.0]),
        "method": (("method",), ["none"]),
        "evaluation": (("evaluation",), [0]),
        "constraint": (("constraint",), ["gap"]),
        "constraint_units": (("constraint",), ["mm"]),
    }
    return xr.Dataset(variables, coordinates).assign_attrs(shipped_method="none")


def _empty_history() -> dict[str, tuple[tuple[str, ...], Any]]:
    nothing = np.full((1, 1), np.nan)
    return {
        "constraint_margin": (("constraint",), [np.nan]),
        "loss": (("method", "evaluation"), nothing),
        "loss_case": (("method", "evaluation", "case"), nothing[..., None]),
        "violation": (("method", "evaluation"), nothing),
        "accepted": (("method", "evaluation"), np.ones((1, 1), np.int8)),
        "design_vector": (("method", "evaluation", "variable"), nothing[..., None]),
        "best_evaluation": (("method",), [0]),
        "best_loss": (("method",), [0.0]),
        "kkt_residual": (("method",), [np.nan]),
    }


def _ligaments(columns: int, rows: int) -> tuple[Ints, Ints]:
    """Lists units and vertices (right, top, left, bottom) that the ligaments join."""
    unit = np.arange(columns * rows).reshape(rows, columns)
    along = np.stack([unit[:, :-1].ravel(), unit[:, 1:].ravel()], axis=1)
    up = np.stack([unit[:-1].ravel(), unit[1:].ravel()], axis=1)
    corner = np.concatenate([np.tile([0, 2], (len(along), 1)), np.tile([1, 3], (len(up), 1))])
    return np.concatenate([along, up]), corner


def _smallest_gap(vertices: Floats, joint: Ints) -> float:
    first, last = vertices[joint[:, 0]], vertices[joint[:, 1]]
    return float(np.linalg.norm(first[:, :, None] - last[:, None], axis=-1).min())
