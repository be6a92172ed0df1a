"""A run that resumes: evaluations in a journal are read back, so that none is computed twice."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from specimen import panels, pressed, squares

import sim

lattice = squares(5, 5)
inner = ((lattice.index > 0) & (lattice.index < 4)).all(axis=1)
scene = pressed(lattice, shortening=6.0).updated(
    region=np.flatnonzero(inner), kind="strain_energy", steps=4, cloak=np.flatnonzero(inner)
)
limits = sim.Limits(edge_length=5.0, block_angle=np.deg2rad(30.0), void_angle=0.0, gap=0.2)
key = "5 x 5 squares, 6 mm in 4 steps"  # of the loss: with another one the journal starts anew
with TemporaryDirectory() as folder:
    results = []
    for evaluations in (3, 6):  # as if the first run had been killed
        with sim.optimise.Journal(Path(folder, "run.journal"), key=key) as journal:
            options = sim.SqpOptions(evaluations=evaluations)
            results.append(sim.minimise(scene, limits, options=options, journal=journal))
            replayed = journal.replayed
losses = [evaluation.loss for evaluation in results[-1].evaluations]
best = results[-1].loss

figure, axes = panels(1)
axes.semilogy(losses, "o-", color="black")
axes.axvline(replayed - 0.5, color="0.7", ls="--")
axes.set(xlabel="evaluation", ylabel="loss (N mm)", title=f"{replayed} read back")
