"""From shades to bytes: light, optics, exposure and the noise of the sensor."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.problem.sections import Lighting, VirtualRecording
from pipeline.virtual_lab import coverage
from pipeline.virtual_lab.film_scene import FilmScene, nested_polygons
from sim.core import Floats, Image

FINER = 3
"""Pixels are divided so often on either side before the blur: it must not see the grid."""

_MAINS = 100.0  # Hz


def sensor_frame(
    scene: FilmScene, instants: Floats, time: float, index: int, asked: VirtualRecording
) -> Image:
    """The picture (rows, columns) that the sensor gives, 8 bit.

    Args:
        scene: what is filmed.
        instants: (instants, units, 3) poses that the exposure averages.
        time: of the frame, s.
        index: of the frame: the noise of each is its own.
        asked: light, sensor and seed.
    """
    shades = np.mean([shade_image(scene, pose, asked.sensor.blur) for pose in instants], axis=0)
    light = _light(asked.light, shades.shape)
    flicker = 1 + asked.light.flicker * np.sin(2 * np.pi * _MAINS * time)
    return _noisy(np.clip(shades, 0, 1) * light * flicker, index, asked)


def shade_image(scene: FilmScene, pose: Floats, blur: float) -> Floats:
    """Mean shade (rows, columns) of every pixel behind the optics, without light and noise."""
    columns, rows = scene.view.camera.size
    rings = nested_polygons(scene, pose)
    fine = rings._replace(points=(rings.points + 0.5) * FINER - 0.5)
    picture = scene.look.board + coverage.coverage_image(fine, (rows * FINER, columns * FINER))
    if blur > 0:
        edge = cv2.BORDER_REPLICATE
        picture = np.asarray(
            cv2.GaussianBlur(picture, (0, 0), blur * FINER, borderType=edge), float
        )
    return picture.reshape(rows, FINER, columns, FINER).mean(axis=(1, 3))


def _light(asked: Lighting, shape: tuple[int, ...]) -> Floats:
    """Brightness (rows, columns) of white."""
    rows, columns = shape
    v, u = np.meshgrid(np.linspace(1, -1, rows), np.linspace(-1, 1, columns), indexing="ij")
    tilted = 1 + asked.slope[0] * u + asked.slope[1] * v
    return asked.level * tilted * (1 - asked.falloff * (u**2 + v**2) / 2)


def _noisy(light: Floats, index: int, asked: VirtualRecording) -> Image:
    """Shot noise (Gaussian, as for many electrons) and read noise, in steps of 8 bit."""
    sensor = asked.sensor
    electrons = light * sensor.full_well
    spread = np.sqrt(np.maximum(electrons, 0) + sensor.read_noise**2)
    random = np.random.default_rng([asked.seed, index])
    electrons += spread * random.standard_normal(light.shape, np.float32)
    return np.clip(np.round(255 / sensor.full_well * electrons), 0, 255).astype(np.uint8)
