"""A band diagram: which waves run through the lattice, at rest and compressed by 5 %."""

import numpy as np
from specimen import CLOAKED, INTACT, PLA, panels, squares

import sim

lattice = squares(6, 6)
scene = sim.Scene(sim.Structure(lattice, PLA), sim.Loads(()))
values = sim.scene.concrete_parameters(scene, lattice.vertices)
cell = sim.vibration.cell_of(lattice, scene.structure.contact, values)
waves, marks = sim.vibration.brillouin_path(cell, 20)
squeezed = sim.vibration.strained(cell, np.diag([0.0, -0.05]), np.diag([1.0, 0.0]))


def frequencies(state=None):
    """Frequencies (n_waves, n_bands) of waves about a state, Hz."""
    return np.sqrt(np.maximum(sim.vibration.bands(cell, waves, state), 0.0)) / (2 * np.pi)


rest, pressed = frequencies(), frequencies(squeezed)
highest = float(rest.max())
gap = float(np.max(rest[:, 1:].min(axis=0) - rest[:, :-1].max(axis=0)))  # widest, Hz

figure, axes = panels(1)
for values, colour, style, name in (
    (rest, INTACT, "-", "at rest"),
    (pressed, CLOAKED, "--", "compressed by 5 %"),
):
    lines = axes.plot(values, color=colour, lw=0.8, ls=style)
    lines[0].set_label(name)
axes.set_xticks(marks, ["Γ", "X", "M", "Γ"])
axes.set(ylabel="frequency (Hz)", ylim=(0, 1300))
axes.legend(fontsize="small")
