"""Draws the silhouettes of this folder: `python experiments/shapes/draw.py`.

Each is a smooth closed curve through a few dozen points placed by eye on a square of 100 x 100,
y up, filled without antialiasing; the leaves of the shamrock are hearts. `logo.jpg` is what a user
might hand in: painted with a round brush, turned by a few degrees, blurred and compressed.
"""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

HERE = Path(__file__).parent
SIZE, MARGIN = 480, 20
FINE = 16  # fixed-point bits of a pixel in OpenCV's drawing functions

Points = NDArray[np.float64]
Image = NDArray[np.uint8]

CAT = [
    *[(30, 2), (24, 4), (24, 10), (27, 16), (26, 26), (25, 38), (26, 50), (29, 59), (25, 65)],
    *[(22, 73), (24, 82), (24, 91), (26, 98), (32, 93), (36, 89), (44, 89), (48, 93), (54, 98)],
    *[(56, 91), (56, 82), (58, 73), (55, 65), (52, 59), (58, 51), (65, 42), (70, 31), (72, 20)],
    *[(76, 14), (83, 14), (87, 21), (87, 30), (83, 37), (82, 43), (86, 46), (91, 42), (96, 32)],
    *[(97, 20), (93, 9), (84, 3), (72, 2), (58, 2), (44, 2)],
]
DOLPHIN = [
    *[(3, 50), (8, 53), (14, 56), (18, 64), (26, 72), (36, 77), (44, 79), (48, 87), (56, 94)],
    *[(58, 92), (57, 84), (58, 76), (66, 70), (74, 60), (80, 48), (84, 36), (91, 31), (98, 25)],
    *[(97, 22), (88, 23), (83, 23), (80, 14), (74, 6), (71, 8), (74, 18), (76, 28), (71, 40)],
    *[(62, 50), (52, 55), (47, 50), (42, 41), (34, 36), (32, 38), (36, 47), (38, 55), (30, 54)],
    *[(22, 51), (14, 48), (6, 46)],
]


def main() -> None:
    """Writes every image beside this file."""
    for name, outline in (("cat", smooth(CAT)), ("dolphin", smooth(DOLPHIN))):
        cv2.imwrite(str(HERE / f"{name}.png"), filled([outline]))
    cv2.imwrite(str(HERE / "shamrock.png"), filled(shamrock()))
    cv2.imwrite(str(HERE / "logo.jpg"), logo(), [cv2.IMWRITE_JPEG_QUALITY, 85])


def smooth(corners: list[tuple[float, float]]) -> Points:
    """A closed cubic spline through points; knots by root distance: no overshoot."""
    closed = np.array([*corners, corners[0]], dtype=float)
    steps = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    knots = np.concatenate([[0.0], np.cumsum(np.sqrt(steps))])
    curve = CubicSpline(knots, closed, bc_type="periodic")
    return np.asarray(curve(np.linspace(0.0, knots[-1], 800)))


def shamrock() -> list[Points]:
    """Three heart-shaped leaves whose tips overlap, and a bent stem that widens downwards."""
    t = np.linspace(0.0, 2 * np.pi, 400)
    x = 13.4 * np.sin(t) ** 3
    y = 13 * np.cos(t) - 5 * np.cos(2 * t) - 2 * np.cos(3 * t) - np.cos(4 * t) + 14.0
    leaf = np.stack([x, y], axis=1) * 1.62
    leaves = [leaf @ turn(angle).T + [50, 52] for angle in np.deg2rad([4.0, 106.0, -98.0])]
    along = np.linspace(0.0, 1.0, 40)[:, None]
    middle = np.array([50.0, 54.0]) + along * [-1.0, -60.0] + along**2 * [13.0, 4.0]
    half = (3.0 + 1.6 * along) * [1.0, 0.25]
    return [*leaves, np.concatenate([middle - half, (middle + half)[::-1]])]


def logo() -> Image:
    """A thick brush stroke in the shape of an arrow that bends upwards, as if drawn by hand."""
    image = np.full((SIZE, SIZE), 255, np.uint8)
    stroke = smooth_open([(14, 22), (30, 27), (47, 36), (60, 49), (69, 63)])
    wobble = 0.8 * np.sin(np.linspace(0, 21, len(stroke)))[:, None] * [0.6, -0.8]
    for point in pixels(stroke + wobble):
        cv2.circle(image, point.tolist(), 48 << FINE, 0, -1, cv2.LINE_AA, FINE)
    head = np.array([(44, 71), (80, 94), (94, 52)], dtype=float)
    cv2.fillPoly(image, [pixels(head)], 0, cv2.LINE_AA, FINE)
    tilt = cv2.getRotationMatrix2D((SIZE / 2, SIZE / 2), 7.0, 0.94)
    image = cv2.warpAffine(image, tilt, (SIZE, SIZE), flags=cv2.INTER_LINEAR, borderValue=255)
    return np.asarray(cv2.GaussianBlur(image, (5, 5), 1.2), np.uint8)


def smooth_open(points: list[tuple[float, float]]) -> Points:
    """A cubic spline through points, ends free."""
    there = np.linspace(0.0, 1.0, len(points))
    return np.asarray(CubicSpline(there, np.array(points))(np.linspace(0.0, 1.0, 400)))


def turn(angle: float) -> Points:
    """Matrix of a rotation."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def filled(outlines: list[Points]) -> Image:
    """Black on white, scaled so that the whole fills the image but for a margin."""
    whole = np.concatenate(outlines)
    low, scale = whole.min(axis=0), 100.0 / np.ptp(whole, axis=0).max()
    image = np.full((SIZE, SIZE), 255, np.uint8)
    rest = (100.0 - scale * np.ptp(whole, axis=0)) / 2
    for outline in outlines:
        cv2.fillPoly(image, [pixels((outline - low) * scale + rest)], 0, cv2.LINE_8, FINE)
    return image


def pixels(points: Points) -> NDArray[np.int32]:
    """Points of the 100 x 100 square, y up, as fixed-point pixels, y down."""
    place = MARGIN + np.array(points) * (SIZE - 2 * MARGIN) / 100
    place[:, 1] = SIZE - place[:, 1]
    return np.round(place * (1 << FINE)).astype(np.int32)


if __name__ == "__main__":
    main()
