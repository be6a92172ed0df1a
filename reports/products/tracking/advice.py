"""Tells what to change before the next recording: one line a finding."""

import numpy as np

from reports.products.tracking.track_quality import TrackQuality

_REMEDIES = {
    "out_of_frame": "leave room about the specimen for its motion",
    "hidden": "keep hands, cables and loading pins out of the view",
    "glare": "use diffuse light from the side, or polarising filters",
    "strayed": "check the design: units may be exchanged",
}
_BLURRED = 1.6
"""Blur of edges, px, from which a lens or the camera's processing is to blame."""
_QUICK = 2.0
"""Way of a unit from frame to frame, px, that may blur it beyond recognition."""
_FAINT = 0.3
"""Contrast, part of the range of brightness, below which noise hides edges."""


def advice(found: TrackQuality) -> list[str]:
    """Lists all findings, what is lost and when first; praise if there is none."""
    told = [words for wrong, words in _findings(found) if wrong]
    return told or ["Nothing to improve: light, sharpness, codec and timing are as they should be."]


def _remedy(reason: str, found: TrackQuality) -> str:
    """Tells what to change where units were lost; a poor fit has the cause that was measured."""
    if reason != "poor_fit":
        return _REMEDIES[reason]
    if found.fastest >= _QUICK:
        return f"expose more briefly, since units move by up to {found.fastest:.1f} px a frame"
    if found.blur >= _BLURRED:
        return f"focus, since edges are blurred by {found.blur:.1f} px"
    if found.light.bright - found.light.dark <= _FAINT:
        return "more light"
    return (
        "light, sharpness and pace are as they should be, so compare the design, the marks and"
        " what stands before the units with the overlay"
    )


def _findings(found: TrackQuality) -> list[tuple[bool, str]]:
    """Lists for each check whether something is wrong, and what to do then."""
    share, light = found.lost.mean(axis=0), found.light
    reason = found.reasons[int(np.argmax(share))]
    contrast, fastest = light.bright - light.dark, max(found.fastest, 0.3)
    return [
        (
            share.sum() >= 0.001,
            f"{100 * share.sum():.2g} % of the units were lost, most often for the reason"
            f" “{reason.replace('_', ' ')}”: {_remedy(reason, found)}.",
        ),
        (
            bool(found.duplicates or found.dropped),
            f"{len(found.dropped)} dropped and {len(found.duplicates)} repeated frames: record to a"
            " faster disk or at a lower rate, and switch automatic exposure off.",
        ),
        (
            found.irregular >= 0.1,
            f"The intervals between frames differ by {100 * found.irregular:.0f} %: record at a"
            " constant frame rate. The file's own times were used.",
        ),
        (
            light.bright <= 0.5 or contrast <= _FAINT,
            f"The picture uses {100 * contrast:.0f} % of the range of brightness: more light, or a"
            " wider aperture.",
        ),
        (
            light.clipped >= 0.02,
            f"{100 * light.clipped:.0f} % of the pixels are overexposed: a shorter exposure.",
        ),
        (
            found.blur >= _BLURRED,
            f"Edges are blurred by {found.blur:.1f} px, 0.7 px being sharp: focus on the faces of"
            " the units; where they are in focus, the camera smooths or enlarges the picture, so"
            " switch digital zoom, stabilisation and noise reduction off.",
        ),
        (
            light.flicker >= 0.03,
            f"The brightness varies by {100 * light.flicker:.0f} % from frame to frame: use"
            " lamps that do not flicker, and fix exposure and gain.",
        ),
        (
            found.pitch <= 30,
            f"A unit is only {found.pitch:.0f} px wide: go nearer, use more pixels, or put larger"
            " dots on the units.",
        ),
        (
            found.stream.alone <= 0.9,
            f"The codec ({found.stream.codec}) predicts most frames from others, which moves whole"
            " units by 0.02 px to 0.06 px unseen: record with an intra codec, or without loss.",
        ),
        (
            found.fastest >= 0.5,
            f"The fastest unit moves {found.fastest:.1f} px from frame to frame: expose for less"
            f" than {min(100.0, 30 / fastest):.0f} % of the interval of the frames, so that it"
            " blurs by less than 0.3 px.",
        ),
        (
            not np.isfinite(found.floor[0]),
            "No frames at rest: film the specimen for a second before it moves, to see the noise.",
        ),
    ]
