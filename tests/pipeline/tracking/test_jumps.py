"""Jumps by whole pitches from a frame to the next, after which most units lie where others lay."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.tracking.clip_scripts import GRID, ClipScript
from benchmarks.tracking.rendering import View
from benchmarks.tracking.wild_clips import errors, film_clip, track_clip
from sim.core import Floats
from tests.tables import some


def jump(pitches: int) -> ClipScript:
    """Scripts a specimen that moves a little, then lies some pitches aside."""

    def shift(time: Floats) -> Floats:
        aside = np.where(time > 0.05, 15.0 * pitches, 0.0) + 10.0 * time
        return np.stack([aside, 0 * time], axis=-1)

    return ClipScript(shift=shift, pace=lambda time: 0 * time, times=np.arange(4) / 30)


@pytest.mark.parametrize("pitches", some([2, -2, 1], 1))
@pytest.mark.parametrize("grid", some([[15, 4], [24, 3]], 2))
def test_units_keep_their_identities_in_a_jump_of_whole_pitches(
    grid: list[int], pitches: int, tmp_path: Path
) -> None:
    """With all of the specimen in view before and after."""
    view = View(size=(30 * (grid[0] + 6), 30 * (grid[1] + 2)), scale=2.0, tilt=0.0)
    script = jump(pitches)._replace(grid=GRID | {"grid": grid}, view=view)
    clip = film_clip(script, tmp_path / "unused.mkv")
    assert clip.visible.all()
    found = errors(clip, track_clip(clip))
    assert (found.lost, found.gross) == (0.0, 0)
