"""Explains to the user that a structure cannot be designed or simulated."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.problem.sections import SeveralDrives, TimeSeriesDrive, single_drives
from pipeline.runtime import UserError
from sim.scene import SceneError

if TYPE_CHECKING:
    from pipeline.problem import Problem
    from sim.constraints import ConstraintVector
    from sim.core import SimulationError
    from sim.optimise import InfeasibleStartError, UnconfirmedError
    from sim.scene import PathConstraints, Scene

_KEYS = {
    "convexity": "constraints.convex",
    "snap": "objective.snap",
    **dict.fromkeys(("slot_angle", "slot_wall", "slot_gap", "slot_turn"), "fabrication.slots"),
}


def infeasible_start(
    error: InfeasibleStartError, constraints: ConstraintVector | PathConstraints, source: Path
) -> UserError:
    """Explains that no design near the start can be made."""
    kind, where = constraints.named(error.constraint)
    if kind == "shim_strain":
        return UserError(
            f"the shims are strained to {1.0 + error.violation:.3g} times the limit at the start"
            f" (load {where}), and by no design nearby less than that limit",
            file=source,
            key="constraints.shim_strain",
            remedy="take a thinner foil (fabrication.shims.thickness), a smaller load, or raise it",
        )
    return UserError(
        f"infeasible at the start, by {error.violation:.3g} mm (angles times 5 mm) at {where},"
        " and no design nearby can be made",
        file=source,
        key=_KEYS.get(kind, f"constraints.{kind}"),
        remedy="ask for less there, or start from another lattice",
    )


def unconfirmed(error: UnconfirmedError, asked: Problem, source: Path) -> UserError:
    """Explains that the path as it is reported confirms none of the designs tried."""
    remedy = "raise it, so that the optimiser sees what the reported path sees"
    if asked.objective.snap == "avoid":
        remedy += f"; or begin elsewhere (optimiser.start), or lower {_key_of_size(asked)}"
    return UserError(str(error), file=source, key="horizon.steps", remedy=remedy)


def without_meaning(error: SceneError, source: Path | None = None) -> UserError:
    """Explains that a scene has no meaning, by the key that it is about."""
    what, _, remedy = str(error).partition("; ")
    return UserError(what, file=source, key=error.key, remedy=remedy)


def _key_of_size(asked: Problem) -> str:
    """Names the key that says how large the drive is, of several the first one's."""
    first = single_drives(asked.drive)[0]
    above = "drives[0]" if isinstance(asked.drive, SeveralDrives) else "drive"
    return f"{above}.file" if isinstance(first, TimeSeriesDrive) else f"{above}.amplitude"


class StoppedError(Exception):
    """Tells that a structure's motion could not be followed to its end.

    Attributes:
        error: why.
        scene: what was simulated.
        name: of the structure.
        asked: (n_times,) times that were asked for, s.
    """

    def __init__(
        self, error: SimulationError, scene: Scene, name: str, asked: NDArray[np.float64]
    ) -> None:
        super().__init__(str(error))
        self.error, self.scene, self.name, self.asked = error, scene, name, asked

    def explain(self, asked: Problem, source: Path, kept: Path | None = None) -> UserError:
        """Explains it to the user of a problem file; the dataset `kept` has what was reached."""
        if isinstance(self.error, SceneError):
            return without_meaning(self.error, source)
        key = _key_of_size(asked)
        lower = f"scale the motion in {key} down" if key.endswith("file") else f"lower {key}"
        remedy = lower if asked.static else f"{lower}, or ask for solver.accuracy: tight"
        if kept is not None:
            remedy += f"; all up to there is in {kept}"
        what = f"the {self.name} structure cannot be simulated{self._place()}: {self.error}"
        return UserError(what, file=source, key=key, remedy=remedy)

    def _place(self) -> str:
        """Describes up to which load it was followed, and where to look."""
        scene, error, place = self.scene, self.error, ""
        if scene.loads.static and error.step is not None:
            reached = 0.0 if error.step == 0 else float(self.asked[error.step - 1])
            share = f"{reached / scene.loads.duration:.0%} of the load path"
            place = f" beyond {share}"
            if all(case.control is None for case in scene.loads.cases):
                laws = [np.asarray(law(np.array([reached]))) for law in scene.loads.motions]
                length = max(float(np.linalg.norm(law[..., :2], axis=-1).max()) for law in laws)
                place = f" beyond a driven displacement of {length:.3g} mm ({share})"
        if error.unit is not None:
            i, j = scene.lattice.index[error.unit]
            place += f", look at unit [{i}, {j}]"
        return place
