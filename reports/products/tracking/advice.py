"""Tells what to change before the next recording: one line a finding."""

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
    """Lists all findings, what is lost and when first; praise if there is none."""
    told = [words for wrong, words in _findings(found) if wrong]
    return told or ["Nothing to improve: light, sharpness, codec and timing are as they should be."]


def _findings(found: TrackQuality) -> list[tuple[bool, str]]:
    """Lists for each check whether something is wrong, and what to do then."""
    share, light = found.lost.mean(axis=0), found.light
    reason = found.reasons[int(np.argmax(share))]
    contrast, fastest = light.bright - light.dark, max(found.fastest, 0.3)
    return [
        (
            share.sum() >= 0.001,
            f"{100 * share.sum():.2g} % of the units were lost, most often for the reason"
            f" “{reason.replace('_', ' ')}”: {_REMEDIES[reason]}.",
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
            light.bright <= 0.5 or contrast <= 0.3,
            f"The picture uses {100 * contrast:.0f} % of the range of brightness: more light, or a"
            " wider aperture.",
        ),
        (
            light.clipped >= 0.02,
            f"{100 * light.clipped:.0f} % of the pixels are overexposed: a shorter exposure.",
        ),
        (
            found.blur >= 1.6,
            f"Edges are blurred by {found.blur:.1f} px: focus on the faces of the units.",
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
