"""Words of a page for what a design keeps to."""

import numpy as np

from reports.base import prose
from reports.facts import checks
from sim.constraints import Limits
from sim.constraints.manufacturability import kinds
from sim.structure import SlotRoom, quads


def test_every_kind_of_constraint_has_a_name() -> None:
    room = SlotRoom(1.0, 5.0, 0.45, 0.8, 0.1)
    limits = Limits(5.0, 0.5, True, 0.0, 0.2, room, 0.5)
    assert None not in (getattr(limits, name) for name in Limits.__dataclass_fields__)
    found = {kind.name for kind in kinds(quads(3, 3, 15.0, 2.25, np.deg2rad(20.0)), limits)}
    told = prose(checks.__file__)
    assert {f"margin_{name}" for name in found} == {
        key for key in told if key.startswith("margin_")
    }
