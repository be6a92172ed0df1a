"""Lists the kinds of files that the project reads: one of each, and how the stages read it."""

import shutil
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from pydantic import BaseModel

from pipeline import datasets
from pipeline.calibration.inputs import Calibration
from pipeline.datasets.tables import TABLES, Kind
from pipeline.fabrication.papers import MANIFEST as MANIFEST_FILE
from pipeline.fabrication.papers import read_manifest
from pipeline.posing import scene_of
from pipeline.problem import canonical_json
from pipeline.problem.fields import csv_columns, units
from pipeline.problem.reading import joint_figure, load, load_section
from pipeline.problem.sections import Codec
from pipeline.runtime import ROOT, CaseLog, SweepResult, case_log
from pipeline.tracking.frames import import_video, load_cell, recording, video
from pipeline.tracking.output import dic_points
from pipeline.virtual_lab import encode_video
from tests.hostile import damage
from tests.hostile.damage import Damages
from tests.pipeline import static
from tests.pipeline.problem import test_lattices
from tests.pipeline.samples import sample

Sort = Literal["YAML", "netCDF", "CSV", "image", "SVG", "DXF", "video", "other"]
Told = list[Any]
"""What was read, as plain numbers and words."""
Make = Callable[[Path], Path]

EXPERIMENTS = ROOT / "experiments"
CLIP = ROOT / "tests/data/tracking/f_silhouette"
LOG = "# kept as it came\ntime,force\n" + "\n".join(f"{k / 10},{k % 7 - 3.5}" for k in range(60))
DIC = "time,x,y,u,v\n" + "\n".join(f"{k // 9},{k % 9},{k % 5},{k / 99},0" for k in range(90))
TEST = "displacement (mm), force (N)\n" + "\n".join(f"{k / 4}, {k * 1.19}" for k in range(30))
SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 90">'
    '<defs><circle id="c" r="9"/></defs><path d="M 10 10 L 80 10 C 80 40 70 70 40 80 Z"/>'
    '<use href="#c" x="20" y="60"/></svg>'
)
POINTS = "points: dic.csv\norigin: [0 mm, 0 mm]\nrotation: 0 deg\ncolumns: {time: t, x: x}\n"
MANIFEST_TEXT = (
    '{"units": ["A1"], "letters_for_ids": true, "shims": {}, "laser_route": "cut", "prebend": {},'
    ' "drives": [], "free_dofs": {}, "stiffness_factors": {}, "as_built": {}, "thin_walls_mm": {},'
    ' "files": {}}'
)
HOLE = "void: { disc: { radius: 7 mm } }"
PICTURED = "void: { image: { file: {name}, width: 16 mm } }"


@dataclass(frozen=True)
class Subject:
    """A kind of file, a good one of which `make` writes into a folder, with what belongs to it."""

    name: str
    make: Make
    read: Callable[[Path], Told]
    sort: Sort = "other"
    damages: Damages = ()  # besides what may befall any file
    sealed: bool = False  # the project's own, which no damage may change unseen
    whole: bool = True  # nothing of it may be missing, either


def _text(name: str, text: str, folder: Path) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def _copied(source: Path, folder: Path) -> Path:
    return Path(shutil.copyfile(source, folder / source.name))


def _problem(path: Path) -> Told:
    asked = load(path)
    scene = scene_of(asked, path.parent)
    return [canonical_json(asked), len(scene.loads.motions)]


def _figure(folder: Path) -> Path:
    study = folder / "fig6_heart"
    for name in ("fig6_heart", "fig6_shamrock"):
        (folder / name).mkdir()
        _text("problem.yaml", "title: x", folder / name)
    return _copied(EXPERIMENTS / "fig6/figure.yaml", study)


def _beside(make: Make, named: Callable[[str], str], folder: Path) -> Path:
    """Writes a file that a problem names, and the problem."""
    path = make(folder)
    text = static.write(folder, static.HOLE, size=5).read_text(encoding="utf-8")
    _text("problem.yaml", named(text).replace("{name}", path.name), folder)
    return path


def _by_problem(path: Path) -> Told:
    return _problem(path.parent / "problem.yaml")


def _void(text: str) -> str:
    assert HOLE in text
    return text.replace(HOLE, PICTURED)


def _listed(text: str) -> str:
    assert test_lattices.QUADS in text
    return text.replace(test_lattices.QUADS, "  kind: file\n  file: {name}\n  spacing: 15 mm\n")


def _driven(text: str) -> str:
    start, end = text.index("drive:"), text.index("horizon:")
    drive = "drive: { kind: time_series, units: right, file: {name} }\n"
    return text[:start] + drive + text[end:].replace("steps: 4", "samples: 4", 1)


def _motion(folder: Path) -> Path:
    rows = "\n".join(f"{k / 10},{-k / 30},0,0" for k in range(11))
    return _text("motion.csv", f"time (s),ux (mm),uy (mm),theta (rad)\n{rows}\n", folder)


def _lattice(suffix: str, folder: Path) -> Path:
    path = folder / f"lattice.{suffix}"
    test_lattices.WRITERS[suffix](path, test_lattices.SQUARES)
    return path


def _picture(name: str, folder: Path) -> Path:
    image = np.full((60, 60), 255, np.uint8)
    image[15:45, 10:40] = 0
    path = folder / name
    cv2.imwrite(str(path), image)
    return path


def _frames(folder: Path) -> Path:
    shots = folder / "shots"
    shots.mkdir()
    for number in range(4):
        _picture(f"shots/{number}.png", folder)
    return shots / "2.png"


def _filmed(name: str, codec: Codec, folder: Path) -> Path:
    path = folder / name
    noise = np.random.default_rng(0).integers(0, 255, (8, 96, 128), dtype=np.uint8)
    encode_video(path, iter(noise), 30.0, codec, {"title": "noise"})
    return path


def _shown(path: Path) -> Told:
    held, found = [], video.read_frames(path, rate=30.0)
    for frame in found:
        held.append((frame.index, frame.time, frame.image.shape, zlib.crc32(frame.image.tobytes())))
        assert frame.image.min() >= 0
        assert frame.image.max() <= 255
    return [video.frame_count(path) > 0, held]


def _dataset(kind: Kind, folder: Path) -> Path:
    path = folder / f"{kind}.nc"
    datasets.write(sample(kind), path, kind, {"problem": "{}", "problem_hash": "0" * 64})
    return path


def _read_dataset(kind: Kind, path: Path) -> Told:
    data = datasets.read(path, kind)
    return [
        sorted((str(name), str(value)) for name, value in data.attrs.items()),
        *([str(name), each.dims, each.values.tolist()] for name, each in data.variables.items()),
    ]


def _cases(folder: Path) -> Path:
    path = folder / "part_0.csv"
    with CaseLog(path, ["drive.frequency"]) as book:
        for number in range(40):
            book.add([(number, [f"{number} Hz"], SweepResult(number / 7, 1.0, -number / 9))])
    return path


def _known(path: Path) -> Told:
    return sorted(case_log.known(path.parent).items())


_yaml = partial(Subject, sort="YAML", damages=damage.YAML)
_sheet = partial(Subject, sort="CSV", damages=damage.CSV)
_netcdf = partial(Subject, sort="netCDF", damages=damage.NETCDF)
_film = partial(Subject, read=_shown, sort="video")


def _model(name: str, make: Make, read: Callable[[Path], BaseModel]) -> Subject:
    return _yaml(name, make, lambda path: [read(path).model_dump_json()])


def _described(path: Path) -> Told:
    described = import_video.description(path)
    text = import_video.recording_text(described, path, "design.nc")
    return [text, import_video.design(described)["vertices"].values.tolist()]


def _drawn(name: str, sort: Sort, make: Make, named: Callable[[str], str] = _void) -> Subject:
    damages = () if sort == "image" else damage.TEXT
    return Subject(name, partial(_beside, make, named), _by_problem, sort, damages)


def _forces(path: Path) -> Told:
    log = load_cell.read(path, recording.LoadCellLog(file=path.name))
    return [log.clock.tolist(), log.force.tolist()]


def _cloud(path: Path) -> Told:
    return [
        part.tolist()
        for part in dic_points.read_points(path, dic_points.DicExport(points=path.name))
    ]


def _readings(path: Path) -> Told:
    wanted = {"displacement": units.LENGTH, "force": units.FORCE}
    return list(csv_columns.read_quantities(path, wanted).tolist())


def _from_study(name: str) -> Make:
    return partial(_copied, EXPERIMENTS / name)


SUBJECTS: tuple[Subject, ...] = (
    _yaml("problem, dynamic", _from_study("fig2/problem.yaml"), _problem),
    _yaml("problem, static", partial(static.write, more=static.HOLE, size=5), _problem),
    _yaml("problem, kagome", _from_study("kagome/problem.yaml"), _problem),
    _model("recording", _from_study("fig2/recordings/cloaked.yaml"), recording.load_recording),
    _model(
        "calibration",
        _from_study("calibration/hinges.yaml"),
        lambda p: load_section(p, Calibration),
    ),
    _model("points", partial(_text, "points.yaml", POINTS), dic_points.load),
    _yaml("description of a video", partial(_copied, CLIP.with_suffix(".yaml")), _described),
    _model("figure of several studies", _figure, joint_figure.load_joint_figure),
    *(
        _netcdf(
            f"{kind} dataset", partial(_dataset, kind), partial(_read_dataset, kind), sealed=True
        )
        for kind in TABLES
    ),
    _netcdf("lattice in netCDF", partial(_beside, partial(_lattice, "nc"), _listed), _by_problem),
    _sheet("lattice in CSV", partial(_beside, partial(_lattice, "csv"), _listed), _by_problem),
    _sheet("measured drive", partial(_beside, _motion, _driven), _by_problem),
    _sheet("load cell", partial(_text, "load.csv", LOG), _forces),
    _sheet("points", partial(_text, "dic.csv", DIC), _cloud),
    _sheet("calibration test", partial(_text, "test.csv", TEST), _readings),
    _sheet("journal of a sweep", _cases, _known, sealed=True, whole=False),
    *(
        _drawn(f"{end} of a void", "image", partial(_picture, f"void.{end}"))
        for end in ("png", "jpg", "bmp", "tiff")
    ),
    _drawn("SVG of a void", "SVG", partial(_text, "void.svg", SVG)),
    Subject("picture of a film", _frames, lambda p: _shown(p.parent), "image"),
    _film("video, H.264", partial(_copied, CLIP.with_suffix(".mp4"))),
    _film("video, lossless", partial(_filmed, "film.mkv", Codec(name="ffv1"))),
    _film("video, small", partial(_filmed, "film.mp4", Codec())),
    _drawn("lattice in DXF", "DXF", partial(_lattice, "dxf"), _listed),
    Subject(
        "manifest of a package",
        partial(_text, MANIFEST_FILE, MANIFEST_TEXT),
        lambda p: [sorted(map(str, read_manifest(p.parent).items()))],
    ),
)
