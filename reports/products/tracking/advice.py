"""Tells what to change before the next recording: one line a finding."""

import numpy as np

from reports.base import prose
from reports.products.tracking.track_quality import TrackQuality

_PROSE = prose(__file__)
_BLURRED = 1.6
"""Blur of edges, px, from which a lens or the camera's processing is to blame."""
_QUICK = 2.0
"""Way of a unit from frame to frame, px, that may blur it beyond recognition."""
_FAINT = 0.3
"""Contrast, part of the range of brightness, below which noise hides edges."""


def advice(found: TrackQuality) -> list[str]:
    """Lists all findings, what is lost and when first; praise if there is none."""
    share, light = found.lost.mean(axis=0), found.light
    contrast = light.bright - light.dark
    wrong = {
        "lost": share.sum() >= 0.001,
        "timing": found.duplicates or found.dropped,
        "irregular": found.irregular >= 0.1,
        "dark": light.bright <= 0.5 or contrast <= _FAINT,
        "clipped": light.clipped >= 0.02,
        "blurred": found.blur >= _BLURRED,
        "flicker": light.flicker >= 0.03,
        "small": found.pitch <= 30,
        "codec": found.stream.alone <= 0.9,
        "quick": found.fastest >= 0.5,
        "restless": not np.isfinite(found.floor[0]),
    }
    reason = found.reasons[int(np.argmax(share))]
    words = {
        "lost": 100 * share.sum(),
        "reason": reason.replace("_", " "),
        "remedy": _remedy(reason, found),
        "dropped": len(found.dropped),
        "duplicates": len(found.duplicates),
        "irregular": 100 * found.irregular,
        "contrast": 100 * contrast,
        "clipped": 100 * light.clipped,
        "blur": found.blur,
        "flicker": 100 * light.flicker,
        "pitch": found.pitch,
        "codec": found.stream.codec,
        "fastest": found.fastest,
        "exposure": min(100.0, 30 / max(found.fastest, 0.3)),
    }
    told = [_PROSE["findings"][name].format_map(words) for name, bad in wrong.items() if bad]
    return told or [_PROSE["praise"]]


def _remedy(reason: str, found: TrackQuality) -> str:
    """Tells what to change where units were lost."""
    if reason == "poor_fit":
        causes = {
            "quick": found.fastest >= _QUICK,
            "blurred": found.blur >= _BLURRED,
            "dark": found.light.bright - found.light.dark <= _FAINT,
        }
        reason = next((cause for cause, there in causes.items() if there), "unknown")
    text: str = _PROSE["remedies"][reason]
    return text.format(fastest=found.fastest, blur=found.blur)
