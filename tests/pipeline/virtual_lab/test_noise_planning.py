"""Clips of a planned set-up show what its film shows, and are compared as they are tracked."""

from typing import Any

import numpy as np
import pytest

from pipeline.problem.sections import VirtualRecording
from pipeline.tracking.frames import import_video
from pipeline.virtual_lab import noise_planning
from pipeline.virtual_lab.filming import VirtualFilm, prepare_film
from pipeline.virtual_lab.noise_planning import ExpectedNoise, PlannedSetup
from tests.pipeline.virtual_lab.conftest import GRID, SETUP, film_of, response

FRAMES = 16
SHOWN = [
    {},
    {"duration": "4 s"},
    {"duration": "1 s", "start": "0.2 s", "end": "0.6 s"},
    {"start": "0.4 s"},
]


def expected(**changes: object) -> ExpectedNoise:
    setup = VirtualRecording.model_validate({**SETUP, **changes})
    planned = PlannedSetup("bare", setup, GRID["spacing_mm"])
    made = response(import_video.design(GRID))
    return noise_planning.expected_noise(made, "cloaked", 0, planned, FRAMES)


@pytest.mark.parametrize("changes", SHOWN)
def test_a_clip_is_the_beginning_of_the_film(
    changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    clips: list[VirtualFilm] = []

    def prepared(*args: Any) -> VirtualFilm:  # noqa: ANN401
        clips.append(prepare_film(*args))
        raise InterruptedError

    monkeypatch.setattr(noise_planning, "prepare_film", prepared)
    with pytest.raises(InterruptedError):
        expected(**changes)
    film = film_of("bare", **{**changes, "still": "0.3 s"}).motion
    count = len(clips[0].motion.time)
    assert count == min(FRAMES, len(film.time))
    np.testing.assert_allclose(clips[0].motion.pose, film.pose[:count], atol=1e-9)


def test_a_clip_that_starts_later_is_compared_from_its_first_frame() -> None:
    found = expected(start="0.4 s")
    assert found.lost == 0.0
    assert (found.rmse < 0.2).all(), found.rmse


def test_a_frame_is_exposed_no_longer_than_it_lasts() -> None:
    base = PlannedSetup("bare", VirtualRecording(), GRID["spacing_mm"])
    tried = noise_planning.SetupOptions((), (), (100.0, 2000.0), (), ())
    slow, quick = noise_planning.setup_combinations(base, tried)
    assert slow.setup.sensor.exposure == VirtualRecording().sensor.exposure
    assert quick.setup.sensor.exposure == 0.0005
    assert [each.columns["exposure_ms"] for each in (slow, quick)] == ["1", "0.5"]
