from typing import cast

import numpy as np
import pytest
import xarray as xr

from reports.products.certificate.facts import certificate_facts
from reports.products.certificate.figure import CertifiedDesign
from reports.study import StudyResults


class Worst:
    """Stands for the study under the worst load."""

    response = xr.Dataset(
        {"loss": (("structure", "case"), [[2.0], [0.5]])}, {"structure": ["altered", "cloaked"]}
    )


def certified(losses: list[float], ends: list[float]) -> CertifiedDesign:
    made: dict[str, tuple[tuple[str, str], list[list[float]]]] = {}
    for name, loss, found in (("load", "loss", losses), ("found", "found_loss", ends)):
        dims = ("design", "load" if name == "load" else "search")
        rest = [[1.0] * len(found)]
        parts = ("direction", "amplitude", "frequency")
        made |= {loss: (dims, [found]), f"{name}_setup": (dims, [[0.0] * len(found)])}
        made |= {f"{name}_{part}": (dims, rest) for part in parts}
    nominal = {name: ("design", [0.1]) for name in ("nominal_loss", "nominal_worst")}
    return CertifiedDesign(
        xr.Dataset(made | nominal, {"design": ["cloaked"]}), cast(StudyResults, Worst())
    )


@pytest.mark.parametrize(
    ("random", "ends", "near"),
    [
        (0.5, [1.0, 0.97, 0.9, np.nan], 2),
        (1.01, [1.0, 0.97, 0.9, np.nan], 2),
        (2.0, [1.0, 0.97, 0.9, np.nan], 0),  # a random load was worse than all that were found
    ],
)
def test_searches_are_near_the_worst_that_anything_found(
    random: float, ends: list[float], near: int
) -> None:
    known = {each.key: each for each in certificate_facts(certified([0.2, random], ends))}
    assert known["worst_found"].value == max(random, 1.0)
    assert known["near"].value == near


def test_losses_that_are_energies_have_their_unit() -> None:
    found = certified([0.2, 0.5], [1.0, 0.9])
    found.data["loss"].attrs["units"] = "N mm"
    known = {each.key: each for each in certificate_facts(found)}
    for key in ("mean", "share_95", "worst_random", "worst_found", "nominal", "nominal_worst"):
        assert known[key].unit == "N mm"
        assert known[key].ours.endswith(" N mm")
    assert known["worst_over_mean"].unit == "1"
