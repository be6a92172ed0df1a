"""Draws specimens as a lab has them: off their design, and driven as shakers drive."""

from typing import NamedTuple

import numpy as np

from pipeline.posing import PosedStructure, drawn
from pipeline.problem.sections import DriveFaults, SpecimenFaults
from pipeline.runtime import UserError
from sim.core import Numbers
from sim.scene import Scene
from sim.solvers import MotionLaw

STREAM = 2
"""First word of the seeds of all draws here, so that no predicted specimen equals one of them."""
SAMPLES = 1001
"""Of the planned motion, to find its largest displacement."""


class ImperfectDrive(NamedTuple):
    """Drives not quite as planned (``sim.solvers.loads.MotionLaw``)."""

    planned: MotionLaw  # the motion that was asked for
    place: Numbers  # (n_units, 2) of the driven units from their middle, mm
    largest: Numbers  # (2,) the planned motion's largest displacement, mm
    turning: float  # when a static load is taken off again, s; past the end if it is not
    end: float  # of the motion, s
    # gain, turn, cross, tilt, drift, delay: see ``Shaking``
    gain: float
    turn: float
    cross: float
    tilt: float
    drift: Numbers
    delay: float

    def __call__(self, times: Numbers) -> Numbers:
        """Returns the motion (n_times, n_units, 3) at the given times, s."""
        xp = times.__array_namespace__()
        since = xp.maximum(times - self.delay, 0.0)
        planned = self.planned(xp.minimum(since, 2 * self.turning - since))
        amplitude = xp.hypot(*self.largest)
        along = xp.asarray(self.largest) / amplitude
        far = planned[:, :2] @ along / amplitude
        bent = planned[:, :2] + self.cross * amplitude * far[:, None] ** 2 * _perpendicular(along)
        turned = xp.cos(self.turn) * bent + xp.sin(self.turn) * _perpendicular(bent)
        path = self.gain * turned + times[:, None] / self.end * xp.asarray(self.drift)
        angle = self.tilt * far
        cos, sin = xp.cos(angle)[:, None, None] - 1, xp.sin(angle)[:, None, None]
        place = xp.asarray(self.place)
        swung = cos * place + sin * _perpendicular(place)
        rotation = xp.broadcast_to((planned[:, 2] + angle)[:, None], swung.shape[:2])
        return xp.concatenate([path[:, None] + swung, rotation[..., None]], axis=2)


def _perpendicular(vector: Numbers) -> Numbers:
    """Turns vectors (..., 2) by a right angle counter-clockwise."""
    return vector.__array_namespace__().stack([-vector[..., 1], vector[..., 0]], axis=-1)


def make_specimen(
    structure: PosedStructure, case: int, asked: SpecimenFaults, end: float
) -> PosedStructure:
    """Draws a specimen of a structure under one of its load cases, whose motion ends at `end`, s.

    Raises:
        UserError: its units would overlap, or it does not come to rest.
    """
    copy = drawn(*structure, asked, (STREAM, asked.seed))
    if copy.failure is not None:
        what = f"the specimen cannot be made: {copy.failure}"
        remedy = "give another seed, or smaller tolerances"
        raise UserError(what, key="virtual.specimen", remedy=remedy)
    made = copy.scene.driven_by(
        imperfect_drive(copy.scene, case, asked.drive, end, asked.unload),
        duration=end,
        frequency=None,
        reference=None,
        symmetry="none",
    )
    return PosedStructure(made, copy.vertices)


def imperfect_drive(
    scene: Scene, case: int, asked: DriveFaults, end: float, unload: bool
) -> ImperfectDrive:
    """Makes the drive of a load case as the specimen has it, up to the `end`, s.

    `unload` takes the load off again in the second half.
    """
    planned = scene.loads.motions[case]
    path = np.asarray(planned(np.linspace(0, scene.loads.duration, SAMPLES)))[:, :2]
    site = scene.lattice.site[scene.loads.driven]
    return ImperfectDrive(
        planned,
        site - site.mean(axis=0),
        path[np.hypot(*path.T).argmax()],
        end / 2 if unload else end,
        end,
        asked.gain,
        asked.turn,
        asked.cross,
        asked.tilt,
        np.array(asked.drift),
        asked.delay,
    )
