"""A track: a drawn video of a compressed lattice is tracked and laid beside the simulation."""

from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from specimen import CLOAKED, INTACT, panels, pressed, squares

import sim
from pipeline.tracking.frames import read_frames
from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.tracking.motion import track_video

SCALE, FINE, MARGIN = 5.0, 8, 20.0  # px/mm, subpixels a side, mm
NOISE = np.random.default_rng(0)
lattice = squares(5, 5)
path = sim.simulate(pressed(lattice, shortening=4.0), times=np.linspace(0.0, 1.0, 11))
CORNERS = lattice.vertices.reshape(-1, 4, 2)
poses = path.displacement[0]  # (n_times, n_units, 3), mm and rad
ORIGIN = lattice.site.min(axis=0) - MARGIN
SIZE = tuple(((np.ptp(lattice.site, axis=0) + 2 * MARGIN) * SCALE).astype(int))  # px


def picture(pose):
    """Draws the units in a pose, black on white, seen by a camera whose rows run down."""
    image = np.full((FINE * SIZE[1], FINE * SIZE[0]), 220, np.uint8)
    place = sim.structure.displaced(lattice, lattice.vertices, pose)
    seen = (place - ORIGIN) * SCALE * FINE
    for unit in range(lattice.n_units):
        corners = seen[lattice.unit == unit] * [1, -1] + [0, len(image)]
        cv2.fillPoly(image, [np.round(corners * 256).astype(np.int32)], 30, cv2.LINE_8, 8)
    blurred = cv2.GaussianBlur(cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA), (0, 0), 0.8)
    return np.round(blurred + 2.0 * NOISE.normal(size=blurred.shape)).clip(0, 255).astype(np.uint8)


with TemporaryDirectory() as folder:
    video = Path(folder) / "press.mkv"
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter.fourcc(*"FFV1"), 10.0, SIZE, False)
    for pose in poses:
        writer.write(picture(pose))
    writer.release()
    centre, joints = CORNERS.mean(axis=1), lattice.ligament_units
    joined = np.isin(np.arange(lattice.n_vertices), lattice.ligaments).reshape(-1, 4)
    shown = SpecimenOutlines(lattice.id, centre, CORNERS - centre[:, None], joints, joined)
    track = track_video(read_frames(video), shown, px_per_mm=SCALE)

error = track.displacement[..., :2] - poses[..., :2]
rms_px = float(np.sqrt(np.mean(error**2))) / track.calibration.pixel
lost = int((track.quality != 0).sum())
turned = int(np.abs(poses[-1, :, 2]).argmax())

figure, (left, right) = panels(2)
left.imshow(picture(poses[-1]), cmap="gray")
left.set(title="last frame", xticks=[], yticks=[])
turn = np.rad2deg(track.displacement[:, turned, 2])
right.plot(track.time, np.rad2deg(poses[:, turned, 2]), color=INTACT, label="simulated")
right.plot(track.time, turn, "o", ms=3, color=CLOAKED, label="tracked")
right.set(xlabel="time (s)", ylabel=f"rotation of unit {lattice.id[turned]} (deg)")
right.legend(fontsize="small")
