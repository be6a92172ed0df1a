"""What a comparison tells in words: how its sides were brought together, how its band is drawn."""

from __future__ import annotations

import numpy as np

from pipeline.comparison.comparison_dataset import SEED, Compared
from pipeline.comparison.metrics import COPIES, LEVEL
from pipeline.problem import Problem

_BY_TIME = (
    "cross-correlation of the measured and the nominal motion of the driven units, refined below a"
    " frame by golden section"
)
_BY_LOAD = (
    "equal displacement of the driven units along the drive is equal load, both on the way there"
    " and back"
)
_AMBIGUOUS = "; other lags are as good: the nearest to the video's start was taken"
_DRIVING = (
    "each degree of freedom of the driven and clamped units by a smoothing spline that departs from"
    " the track by its standard uncertainty"
)


def words(asked: Problem, made: Compared) -> dict[str, str]:
    """Attributes of a comparison.

    Args:
        asked: the problem, with the tolerances of the band.
        made: the comparison.
    """
    lag = made.axis.lag
    ambiguous = lag is not None and lag.ambiguous
    return {
        "axis": "load" if lag is None else "time",
        "alignment": (_BY_LOAD if lag is None else _BY_TIME) + (_AMBIGUOUS if ambiguous else ""),
        "resampling": _resampling(made),
        "driving": _DRIVING,
        "band": _band(asked, made),
        "bootstrap": f"{COPIES} copies over units and blocks of frames, with the measurement's"
        f" noise; {100 * LEVEL:g} % intervals; seed {SEED}",
    }


def _resampling(made: Compared) -> str:
    kept, whole = len(made.measurement.frames), made.measurement.track.sizes["time"]
    return (
        f"none of the measurement ({kept} of {whole} frames); the redriven simulation is asked for"
        " at the frames; the response of the study is a cubic spline through its samples"
    )


def _band(asked: Problem, made: Compared) -> str:
    shares = asked.tolerances.model_dump(exclude={"assembly"})
    sizes = ", ".join(f"{name} {size:g}" for name, size in shares.items())
    off = asked.tolerances.assembly
    places = f"assembly {off.shift:g} mm and {np.rad2deg(off.turn):.2g} deg"
    samples = len(made.simulation.copies)
    return (
        f"{100 * made.level:g} % of {samples} imperfect copies ({sizes}, {places}), at each instant"
    )
