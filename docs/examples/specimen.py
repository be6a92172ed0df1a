"""Holds what the examples share: the paper's specimens, and a drawing of rigid units."""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import PolyCollection

import sim

SPACING = 15.0  # mm
DENSITY, AXIAL, SHEAR, BENDING, CONTACT = 6.18e-9, 120.0, 1.19, 1.5, 1.5
PLA = sim.Material(DENSITY, AXIAL, SHEAR, BENDING, CONTACT,
                   *sim.damping_of_ratio(0.0186, DENSITY, SPACING, SHEAR, BENDING))  # fmt: skip
INTACT, ALTERED, CLOAKED = "black", "tab:orange", "tab:purple"


def squares(columns, rows, bias=20.0):
    """Builds rotating squares with ligaments of 2.25 mm; the bias is in degrees."""
    return sim.quads(columns, rows, SPACING, ligament_length=2.25, bias_angle=np.deg2rad(bias))


def rows_of(lattice, row):
    """Lists the units of a row: 0 is the bottom, -1 the top."""
    height = lattice.index[:, 1]
    return np.flatnonzero(height == (height.max() + 1 + row if row < 0 else row))


def pressed(lattice, shortening, contact=None, supports=None):
    """Poses a static compression by the top row; the bottom row is clamped."""
    structure = sim.Structure(lattice, PLA, *([contact] if contact else []))
    push = sim.LinearRamp(shortening, duration=1.0, direction=-np.pi / 2)
    top = sim.PrescribedMotion(rows_of(lattice, -1), push)
    held = supports or (sim.Clamp(rows_of(lattice, 0)),)
    return sim.Scene(structure, sim.Loads((top,), held, static=True))


def draw(axes, lattice, motion=None, values=None, vertices=None, **style):
    """Draws the units, moved by a motion (n_units, 3) and coloured by values (n_units,)."""
    place = lattice.vertices if vertices is None else np.asarray(vertices)
    if motion is not None:
        place = sim.structure.displaced(lattice, place, np.asarray(motion))
    polygons = [place[lattice.unit == unit] for unit in range(lattice.n_units)]
    look = {"facecolor": "0.8", "edgecolor": "0.3", "linewidth": 0.4} | style
    units = PolyCollection(polygons, array=values, **look)
    axes.add_collection(units)
    axes.set(aspect="equal", xticks=[], yticks=[])
    axes.autoscale_view()
    return units


def panels(count=1, width=3.4, height=2.6):
    """Makes a figure with some axes in a row; sizes in inch for each."""
    return plt.subplots(1, count, figsize=(width * count, height), layout="constrained")
