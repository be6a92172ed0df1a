"""Tells what to change before the next recording: one line a finding."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reports.products.tracking.track_quality import TrackQuality

_REMEDIES = {
    "out_of_frame": "leave room about the specimen for its motion",
    "hidden": "keep hands, cables and loading pins out of the view",
    "glare": "use diffuse light from the side, or polarising filters",
    "poor_fit": "check the focus, the marks and the design",
    "strayed": "check the design: units may be exchanged",
}


def advice(found: TrackQuality) -> list[str]:
    """Returns all findings, what is lost and when first; praise if there is none."""
    told = [line for check in _CHECKS if (line := check(found))]
    return told or ["Nothing to improve: light, sharpness, codec and timing are as they should be."]


def _lost(found: TrackQuality) -> str:
    share = found.lost.mean(axis=0)
    worst = int(np.argmax(share))
    if share.sum() < 0.001:
        return ""
    name = found.reasons[worst]
    return (
        f"{100 * share.sum():.2g} % of the units were lost, most often for the reason"
        f" “{name.replace('_', ' ')}”: {_REMEDIES[name]}."
    )


def _timing(found: TrackQuality) -> str:
    if not (found.duplicates or found.dropped):
        return ""
    return (
        f"{len(found.dropped)} dropped and {len(found.duplicates)} repeated frames: record to a"
        " faster disk or at a lower rate, and switch automatic exposure off."
    )


def _intervals(found: TrackQuality) -> str:
    if found.irregular < 0.1:
        return ""
    return (
        f"The intervals between frames differ by {100 * found.irregular:.0f} %: record at a"
        " constant frame rate. The file's own times were used."
    )


def _dim(found: TrackQuality) -> str:
    if found.light.bright > 0.5 and found.light.bright - found.light.dark > 0.3:
        return ""
    return (
        f"The picture uses {100 * (found.light.bright - found.light.dark):.0f} % of the range of"
        " brightness: more light, or a wider aperture."
    )


def _clipped(found: TrackQuality) -> str:
    if found.light.clipped < 0.02:
        return ""
    return f"{100 * found.light.clipped:.0f} % of the pixels are overexposed: a shorter exposure."


def _flicker(found: TrackQuality) -> str:
    if found.light.flicker < 0.03:
        return ""
    return (
        f"The brightness varies by {100 * found.light.flicker:.0f} % from frame to frame: use"
        " lamps that do not flicker, and fix exposure and gain."
    )


def _blurred(found: TrackQuality) -> str:
    if found.blur < 1.6:
        return ""
    return f"Edges are blurred by {found.blur:.1f} px: focus on the faces of the units."


def _fast(found: TrackQuality) -> str:
    if found.fastest < 0.5:
        return ""
    return (
        f"The fastest unit moves {found.fastest:.1f} px from frame to frame: expose for less than"
        f" {min(100.0, 30 / found.fastest):.0f} % of the interval of the frames, so that it blurs"
        " by less than 0.3 px."
    )


def _coarse(found: TrackQuality) -> str:
    if found.pitch > 30:
        return ""
    return (
        f"A unit is only {found.pitch:.0f} px wide: go nearer, use more pixels, or put larger dots"
        " on the units."
    )


def _codec(found: TrackQuality) -> str:
    if found.stream.alone > 0.9:
        return ""
    return (
        f"The codec ({found.stream.codec}) predicts most frames from others, which moves whole"
        " units by 0.02 px to 0.06 px unseen: record with an intra codec, or without loss."
    )


def _still(found: TrackQuality) -> str:
    if np.isfinite(found.floor[0]):
        return ""
    return "No frames at rest: film the specimen for a second before it moves, to see the noise."


_CHECKS: tuple[Callable[[TrackQuality], str], ...] = (
    _lost,
    _timing,
    _intervals,
    _dim,
    _clipped,
    _blurred,
    _flicker,
    _coarse,
    _codec,
    _fast,
    _still,
)
