"""States facts on the losses over constants of specimens as measured, beside the nominal ones."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.facts.fact_records import Fact, facts_of, percent, printed, significant, worded
from reports.study import display_name
from sim.core import Floats

_ENDS = (0.025, 0.975)
_told = facts_of(__file__)


def constants_facts(
    asked: Problem, made: xr.Dataset | None, nominal: tuple[float, float]
) -> Iterator[Fact]:
    """Yields mean and 95 % of losses and of their reduction over the constants, if there are any.

    `nominal` are losses of the altered structure and of the design, at the problem's own constants.
    """
    if made is None:
        return
    unit = "N mm" if asked.objective.kind == "strain_energy" else "1"
    sound = (made["status"] == "ok").values
    altered, cloaked = (made[name].values[sound] for name in ("loss_altered", "loss"))
    if not len(cloaked):
        why = str(made["status"].values[0])
        yield _told("constants_loss_end", np.nan, "none", unit=unit, note=why)
        return
    failed = f", {(~sound).sum()} of them failed" if not sound.all() else ""
    for key, values, own in (("start", altered, nominal[0]), ("end", cloaked, nominal[1])):
        words = {"unit": unit, "own": worded(own, unit, 3), "count": len(sound), "failed": failed}
        words["shown"] = display_name(asked, "altered").lower()
        mean = float(values.mean())
        yield _told(f"constants_loss_{key}", mean, _quantity(values, unit), **words)
    gain = 1 - cloaked / altered
    low, high = (percent(float(end)) for end in np.quantile(gain, _ENDS))
    ours, mean = f"{percent(float(gain.mean()))} ({low} to {high})", 100 * float(gain.mean())
    yield _told("constants_reduction", mean, ours, own=percent(1 - nominal[1] / nominal[0]))


def _quantity(values: Floats, unit: str) -> str:
    low, high = np.quantile(values, _ENDS)
    ends = (printed(significant(float(end), unit, 3), "1") for end in (low, high))
    return f"{worded(float(values.mean()), unit, 3)} ({' to '.join(ends)})"
