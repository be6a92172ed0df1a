"""Units to cut: slots for the shims, names and tracking dots, as a drawing for the laser cutter."""

from pathlib import Path
from tempfile import TemporaryDirectory

import ezdxf
import numpy as np
from shapely import Polygon
from specimen import CLOAKED, panels, squares

from pipeline.fabrication.files.drawing_files import write_dxf
from pipeline.fabrication.parts import labels
from pipeline.fabrication.plates import laser_sheets
from pipeline.fabrication.units import UnitNetwork, build_specimen
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication

lattice = squares(3, 3)
settings = Fabrication.model_validate({"thickness": "8 mm"}, context=SIM_UNITS)
ids = [int(number) for number in lattice.id]
names = labels([(int(i), int(j)) for i, j in lattice.index])
first = lattice.first_vertex[lattice.ligament_units]
ends = np.stack([lattice.ligament_units, lattice.ligaments - first], axis=-1).tolist()
along = lattice.ligament_vectors / np.linalg.norm(lattice.ligament_vectors, axis=1)[:, None]
net = UnitNetwork(
    numbers=tuple(ids),
    polygons={k: Polygon(lattice.vertices[lattice.unit == k]) for k in ids},
    labels=dict(zip(ids, names, strict=True)),
    index={k: tuple(map(int, lattice.index[k])) for k in ids},
    ligaments=tuple((n, tuple(a), tuple(b), along[n]) for n, (a, b) in enumerate(ends)),
    clamped=(),
    driven=(),
)
specimen = build_specimen(net, settings, ("example", "intact"), Path("lattice"))
widest = max(ligament.strain for ligament in specimen.ligaments)  # of shims before any load
sheet = next(laser_sheets("units", [u.part for u in specimen.units], settings.laser, "here"))
with TemporaryDirectory() as folder:
    write_dxf(sheet, Path(folder) / "units.dxf")
    drawing = ezdxf.readfile(Path(folder) / "units.dxf").modelspace()
    cuts = [line.get_points("xy") for line in drawing.query('LWPOLYLINE[layer=="CUT_OUTER"]')]
n_parts, cut_length = len(cuts), sum(Polygon(cut).length for cut in cuts)  # mm

figure, axes = panels(1, height=3.4)
for unit in specimen.units:
    axes.plot(*unit.outline.exterior.xy, color="black", lw=0.7)
    for stroke in unit.lettering:
        axes.plot(*stroke.T, color="0.5", lw=0.7)
for ligament in specimen.ligaments:
    slots = [s for u in specimen.units for s in u.slots if s.ligament == ligament.number]
    axes.plot(*np.stack([slot.end for slot in slots]).T, color=CLOAKED, lw=1.5)
axes.set(aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
