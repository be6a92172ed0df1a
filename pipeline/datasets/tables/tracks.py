"""Lists variables of filmed motions: as tracked, as rendered, as simulated for it."""

from __future__ import annotations

from dataclasses import replace

from pipeline.datasets.tables.designs import NETWORK, SHAPE
from pipeline.datasets.tables.variables import LABELS, UNIT, Table, Variable, label

_TRACKED = ("time", "unit", "dof")

TRACK: Table = UNIT | {
    "time": label(("time",), "s", "time of the frame since the start of the window"),
    "dof": LABELS["dof"],
    "vertices": replace(SHAPE["vertices"], long_name="vertices at rest, counter-clockwise"),
    "displacement": Variable(
        _TRACKED, "mm (ux, uy), rad (theta)", "displacement of the units", "float32", gaps=True
    ),
    "sigma": Variable(
        _TRACKED,
        "mm (ux, uy), rad (theta)",
        "standard uncertainty of the displacement",
        "float32",
        gaps=True,
    ),
    "quality": Variable(
        ("time", "unit"),
        "1",
        "whether the unit was found, or why not",
        "int8",
        flags={
            "good": 0,
            "out_of_frame": 1,
            "hidden": 2,
            "glare": 3,
            "poor_fit": 4,
            "strayed": 5,
            "absent": 6,
        },
    ),
    "timing": Variable(
        ("time",),
        "1",
        "timing of the frame: a duplicate shows the instant before, a frame is missing before",
        "int8",
        flags={"steady": 0, "duplicate": 1, "dropped": 2},
    ),
    "frame": Variable(("time",), "1", "number of the frame in the file, from zero", "int64"),
    "load_force": Variable(
        ("time",), "N", "force of the load cell, where there was one", gaps=True
    ),
    "drive_displacement": Variable(
        ("time", "xy"),
        "mm",
        "displacement of the driven units, mean of those that are seen",
        gaps=True,
        coordinate=True,
    ),
    "camera_homography": Variable(
        ("row", "column"),
        "1/mm (columns 0, 1), 1 (column 2)",
        "homography from the specimen's plane to undistorted pixels",
        gaps=True,
    ),
    "camera_centre": Variable(("xy",), "1", "centre of the distortion, pixels", gaps=True),
    "camera_radial": Variable(
        ("power",),
        "1",
        "distortion at half the image's larger side: square and fourth power; of a fisheye, of"
        " the angle to its axis, and as a third half the larger side over the focal length",
        gaps=True,
    ),
    "camera_residual": Variable(
        ("unit", "xy"), "1", "first frame: place of the unit less that by design, pixels", gaps=True
    ),
    "image_size": Variable(("xy",), "1", "width and height of the image, pixels", "int64"),
    "blur": Variable(
        (), "1", "standard deviation of the camera's blur at edges, pixels", gaps=True
    ),
}

_SHOWN = (
    "time",
    "dof",
    "vertices",
    "displacement",
    "camera_homography",
    "camera_centre",
    "camera_radial",
    "image_size",
)

TRUTH: Table = UNIT | {
    **{name: TRACK[name] for name in _SHOWN},
    "displacement": replace(TRACK["displacement"], dtype="float64"),
    "camera_eye": Variable(("xyz",), "mm", "centre of projection, z towards the camera"),
}

SPECIMEN: Table = (
    UNIT
    | NETWORK
    | {
        "direction": label((), "degree", "direction of the planned drive"),
        "time": label(("time",), "s", "time since the start of the drive"),
        **{name: TRACK[name] for name in ("dof", "vertices")},
        "displacement": replace(TRACK["displacement"], dtype="float64"),
        "drive_displacement": Variable(
            ("time", "xy"), "mm", "displacement of the driven units, mean"
        ),
        "drive_force": Variable(
            ("time", "xy"), "N", "force of the drive on all driven units together"
        ),
    }
)

RECORDED = {"recording": "the recording's YAML, as read", "synthetic": "yes if rendered"}
"""Attributes of them all."""
