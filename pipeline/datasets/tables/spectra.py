"""Lists variables of small vibrations: modes, transmission, waves in the unit cell."""

from __future__ import annotations

from pipeline.datasets.tables.designs import NETWORK
from pipeline.datasets.tables.responses import RESPONSE
from pipeline.datasets.tables.variables import CASE, LABELS, UNIT, Table, Variable, label, names

_MODE = ("structure", "state", "mode")
_WAVE = ("compression", "wave", "band")

SPECTRUM: Table = (
    UNIT
    | CASE
    | NETWORK
    | {name: LABELS[name] for name in ("structure", "dof")}
    | {
        "state": names("state", "equilibrium that the vibrations are about"),
        "mode": label(("mode",), "1", "number of the mode, from zero", "int64"),
        "excitation": label(("excitation",), "Hz", "frequency of a small harmonic drive"),
        "compression": label(("compression",), "1", "of the unit cell along x, share of length"),
        "wave": label(
            ("wave",), "1", "way round the zone: 0 its centre, 1 a side, 2 a corner, 3 its centre"
        ),
        "band": label(("band",), "1", "number of the band, from zero", "int64"),
        "vertices": RESPONSE["vertices"],
        "equilibrium": Variable(
            ("structure", "state", "unit", "dof"),
            "mm (ux, uy), rad (theta)",
            "displacement of the units in the equilibrium",
            gaps=True,
        ),
        "frequency": Variable(
            _MODE, "Hz", "eigenfrequency without damping; negative where the state is unstable"
        ),
        "mode_shape": Variable(
            (*_MODE, "unit", "dof"),
            "mm (ux, uy), rad (theta)",
            "motion of the units in a mode, its largest displacement 1 mm",
            gaps=True,
        ),
        "transmission": Variable(
            ("structure", "state", "case", "excitation"),
            "1",
            "root mean square of |u| over the region of interest, over the drive's amplitude",
        ),
        "wave_vector": Variable(("wave", "xy"), "rad mm-1", "wave vector, of the lattice at rest"),
        "lateral_strain": Variable(
            ("compression",), "1", "strain across the compression that relieves the stress"
        ),
        "band_frequency": Variable(
            _WAVE, "Hz", "frequency of a wave without damping; negative where it grows"
        ),
    }
)
