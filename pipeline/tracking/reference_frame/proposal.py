"""Proposes a recording by the first frame of a video: units, markings, and warnings."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
import xarray as xr

from pipeline.runtime import Picture, UserError
from pipeline.tracking.detect import LatticeDetection, classify_markings
from pipeline.tracking.geometry import SpecimenOutlines, as_built, outlines_of_design
from pipeline.tracking.reference_frame.camera_calibration import (
    CameraCalibration,
    RecordingSetup,
    calibrate_camera,
)
from pipeline.tracking.reference_frame.recognition import (
    agreeing_outlines,
    ambiguity_text,
    check_outlines,
    recognise,
    units_in_frame,
    units_out_of_frame,
)
from sim.core import Floats, Image

_LEAST_MARGIN = 0.03  # of the units, by which one structure must be better matched than another
_FOUND, _MISSING = (60, 140, 20), (0, 123, 224)  # blue, green, red


class Proposal(NamedTuple):
    """Holds what the first frame shows."""

    structure: str  # the design's structure that fits best
    specimen: SpecimenOutlines  # its units
    detection: LatticeDetection  # where they are
    kind: str  # dots, speckle or bare
    pixel_size: float  # mm
    warnings: tuple[str, ...]  # what the frame leaves open, in words


def propose(image: Picture, design: xr.Dataset, px_per_mm: float | None = None) -> Proposal:
    """Recognises every structure of the design in a frame; proposes the best.

    Raises:
        UserError: none is there.
    """
    seen, refused = [], []
    for name, specimen in _structures(design):
        try:
            ways = recognise(image, specimen, px_per_mm, RecordingSetup())
            calibration = calibrate_camera(image, specimen, ways[0], RecordingSetup())
            seen.append(_Candidate(name, specimen, ways, calibration))
        except UserError as error:
            refused.append(error)
    if not seen:
        raise refused[0]
    best = max(seen, key=_agreement)
    specimen, calibration = best.specimen, best.calibration
    detection = replace(best.ways[0], camera=calibration.camera)
    check_outlines(specimen, detection, calibration)
    similar = [
        one.name
        for one in seen
        if one != best and _agreement(one) > _agreement(best) - _LEAST_MARGIN
    ]
    kind = classify_markings(image, specimen, detection, 1 / calibration.pixel)
    warnings = tuple(_warnings(best, similar))
    return Proposal(best.name, specimen, detection, kind, calibration.pixel, warnings)


class _Candidate(NamedTuple):
    """Holds a structure of the design, and how it is seen."""

    name: str
    specimen: SpecimenOutlines
    ways: list[LatticeDetection]
    calibration: CameraCalibration

    @property
    def surplus(self) -> int:
        """Counts patches of a unit's size that are none of the structure's units."""
        return self.ways[0].blobs - len(self.ways[0].unit)


def _structures(design: xr.Dataset) -> Iterator[tuple[str, SpecimenOutlines]]:
    """Yields every structure of the design that differs from those before."""
    tried: list[SpecimenOutlines] = []
    for name in ("cloaked", "altered", "intact"):
        specimen = outlines_of_design(as_built(design, name))
        if not any(
            np.array_equal(specimen.ids, one.ids)
            and np.array_equal(specimen.outline, one.outline, equal_nan=True)
            for one in tried
        ):
            tried.append(specimen)
            yield name, specimen


def _agreement(one: _Candidate) -> float:
    """Computes the share of units that agree with a structure, less that of surplus patches."""
    there = units_in_frame(one.specimen, one.calibration)
    fitting = agreeing_outlines(one.specimen, one.calibration.outlines) & there
    return float(fitting.sum() / max(there.sum(), 1)) - one.surplus / one.specimen.count


def _warnings(best: _Candidate, similar: list[str]) -> Iterator[str]:
    if similar:
        yield f"structure: as many units fit {' and '.join(similar)}; say which was built"
    if more := best.surplus:
        yield f"{more} patches of a unit's size that this structure does not have"
    outside = units_out_of_frame(best.specimen, best.calibration)
    if count := int(outside.sum()):
        yield f"{count} units lie outside the first frame and are not tracked: film all of them"
    if missing := int((~outside).sum()) - int((~outside)[best.ways[0].unit].sum()):
        yield f"{missing} units were not found at first sight (orange in the picture); tracking"
        yield "  looks for them again"
    if warning := ambiguity_text(best.ways):
        yield f"turned, mirrored: {warning}"
    yield "window: whether the specimen is at rest in the first frame"
    yield "readout: a phone's rows are read in 10 ms to 30 ms; untold, units seem to move where the"
    yield "  camera does"
    yield "case: under which load case of the study it was"
    yield "load_axis: time, or driven displacement; load_cell: none was named"


def draw_proposal(image: Picture, found: Proposal, note: str = "") -> Image:
    """Draws outlines of all units and their ids on the frame; orange where none was found.

    Args:
        image: the frame.
        found: what it shows.
        note: stands in its corner.
    """
    scale = 2 if max(image.shape) < 1000 else 1
    grey = np.asarray(image, np.uint8)
    drawn = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    drawn = cv2.cvtColor(drawn, cv2.COLOR_GRAY2BGR)
    seen = np.isin(np.arange(found.specimen.count), found.detection.unit)
    for unit, number in enumerate(found.specimen.ids):
        colour = _FOUND if seen[unit] else _MISSING
        corners = found.specimen.centre[unit] + found.specimen.polygon(unit)
        outline = _to_drawing(found.detection.camera.project(corners), scale)
        cv2.polylines(drawn, [outline], True, colour, 2, cv2.LINE_AA)
        x, y = _to_drawing(
            found.detection.camera.project(found.specimen.centre[unit]), scale
        ).tolist()
        _draw_text(drawn, str(number), (x, y), colour)
    _draw_text(drawn, note, (60, 16), _MISSING)
    return np.asarray(drawn, np.uint8)


def _to_drawing(pixels: Floats, scale: int) -> np.ndarray:
    return np.round((pixels + 0.5) * scale - 0.5).astype(np.int32)


def _draw_text(image: np.ndarray, text: str, at: tuple[int, int], colour: tuple[int, ...]) -> None:
    (wide, high), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.4, 1)
    origin = (at[0] - wide // 2, at[1] + high // 2)
    for ink, width in (((255, 255, 255), 3), (colour, 1)):
        cv2.putText(image, text, origin, cv2.FONT_HERSHEY_SIMPLEX, 0.4, ink, width, cv2.LINE_AA)
