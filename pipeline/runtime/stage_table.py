"""Lists the stages: one row each, from which the command line, the rules and hashes follow."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple


class Option(NamedTuple):
    """One option of a command line: its names and what `argparse` is to do with it."""

    names: tuple[str, ...]
    settings: Mapping[str, Any]


def option(*names: str, **settings: Any) -> Option:  # noqa: ANN401  (argparse's own)
    """Makes an option from the arguments of `ArgumentParser.add_argument`."""
    return Option(names, settings)


class Stage(NamedTuple):
    """One row: a rule of this name runs the stage, or rules STAGE_part its parts."""

    name: str
    does: str
    """One line of help."""
    home: str = "pipeline.stages"
    """Package of the module, whose `work` runs the stage."""
    module_name: str = ""
    """Name of the module where it is not the stage's."""
    kind: str | None = None
    """Kind of the dataset that it writes."""
    datasets: tuple[str, ...] = ()
    """Names that a study's report has for what the stage makes, without .nc."""
    inputs: tuple[str, ...] = ()
    """Datasets that it reads, each an option of the command line."""
    unused: tuple[str, ...] | None = None
    """Sections of the problem file that it does not depend on; None where it reads none."""
    threads: str = ""
    """Work that --threads spreads; none where the stage has no such option."""
    options: tuple[Option, ...] = ()
    parts: Mapping[str, tuple[Option, ...]] = {}
    """Commands of the stage by name, each with options of its own."""
    about: str = ""
    """More of help."""
    passes_on: bool = False
    """Hands its words to another program as they are."""
    extra: str = "workflow"
    """Extra of the package that installs what it needs."""

    @property
    def module(self) -> str:
        """Full name of the stage's module."""
        return f"{self.home}.{self.module_name or self.name}"


def _file(name: str, metavar: str, text: str, **settings: Any) -> Option:  # noqa: ANN401
    return option(name, type=Path, metavar=metavar, help=text, **settings)


_OUT = _file("--out", "NC", "dataset to write", required=True)
_DESIGN = _file("--design", "NC", "the design", required=True)
_RESPONSE = _file("--response", "NC", "its response", required=True)
_RECORDING = option("recording", type=Path, metavar="RECORDING.yaml")
_STRUCTURES = ("intact", "altered", "cloaked")

PROBLEM = (
    _file("--problem", "YAML", "the problem file", required=True),
    option("--preset", metavar="NAME", help="one of the presets in the problem file"),
)
"""Options by which a stage finds its problem."""

_IN_PARTS = {
    "run": (
        *PROBLEM,
        _DESIGN,
        option("--chunk", type=int, required=True, help="number of this part, from zero"),
        option("--chunks", type=int, required=True, help="number of parts"),
        option("--threads", type=int, default=1, help="cases simulated side by side"),
        _OUT,
    ),
    "gather": (option("--parts", type=Path, nargs="+", required=True, metavar="NC"), _OUT),
}
"""Commands of a stage whose work is done in parts, which are then joined."""

_WORDS = ("title", "doc", "report")
_APART = (*_WORDS, "prediction", "spectrum")
_SHAPE_ONLY = (*_APART, "response", "sweep", "robustness", "fabrication")
"""What does not matter to a stage that looks at the study's own loss alone."""

_ROWS = (
    Stage(
        "design",
        "optimise the cloak of a problem by one method",
        kind="design_method",
        unused=_SHAPE_ONLY,
        threads="load cases",
        options=(
            option("--method", required=True, choices=("sqp", "mma"), help="optimisation method"),
            _OUT,
            _file("--start", "NC", "the design to start from, where optimiser.start is study"),
        ),
        about="Every evaluation goes to a journal, from which the same command resumes after any"
        " kind of end.",
    ),
    Stage(
        "select",
        "choose the feasible design with the lower loss",
        kind="design",
        datasets=("design",),
        unused=_SHAPE_ONLY,
        options=(option("--designs", type=Path, nargs="+", required=True, metavar="NC"), _OUT),
    ),
    Stage(
        "simulate",
        "simulate the structures of a design",
        kind="response",
        datasets=("response", "geometric_response"),
        inputs=("design",),
        unused=(*_APART, "sweep", "robustness", "fabrication"),
        threads="cases",
        options=(_OUT, option("--geometric", action="store_true", help="with contact on distance")),
    ),
    Stage(
        "as_built",
        "simulate the structures of a design with their shims bent as their slots are drawn",
        kind="response",
        datasets=("built",),
        inputs=("design",),
        unused=(*_APART, "sweep", "robustness"),
        threads="cases",
        options=(_OUT,),
    ),
    Stage(
        "redesign",
        "evaluate a design with contact on distance, and optimise it again if that matters",
        kind="design",
        datasets=("geometric_design",),
        inputs=("design", "response"),
        unused=_SHAPE_ONLY,
        threads="load cases",
        options=(_OUT,),
        about="It starts from the design. Every evaluation goes to a journal, as in design.",
    ),
    Stage(
        "verify",
        "check a design with finer steps of load or time, and another contact",
        kind="verification",
        datasets=("verification",),
        inputs=("design",),
        unused=_SHAPE_ONLY,
        threads="cases",
        options=(_OUT,),
    ),
    Stage(
        "sweep",
        "simulate a design at many settings of parameters",
        kind="sweep",
        datasets=("sweep", "constants"),
        unused=(*_APART, "response", "robustness", "fabrication"),
        parts=_IN_PARTS
        | {
            "constants": (
                *PROBLEM,
                _DESIGN,
                option("--threads", type=int, default=1, help="load cases simulated side by side"),
                _OUT,
            )
        },
        about="constants sets the measured constants that the report names, in place of the sweep.",
    ),
    Stage(
        "monte_carlo",
        "simulate imperfect copies of a design",
        kind="scatter",
        datasets=("scatter",),
        unused=(*_APART, "response", "sweep", "fabrication"),
        parts=_IN_PARTS,
    ),
    Stage(
        "spectrum",
        "analyse small vibrations of a design's structures",
        kind="spectrum",
        inputs=("design",),
        unused=(*_WORDS, "prediction", "response", "sweep", "robustness", "fabrication"),
        options=(_OUT,),
    ),
    Stage(
        "robust_gains",
        "evaluate what presets gain that ask for more than the study's own drive",
        kind="gains",
        unused=_SHAPE_ONLY,
        options=(
            option(
                *("--designs",),
                nargs="+",
                required=True,
                metavar="PRESET=NC",
                help="the study's own design as plain=NC, and one for each preset",
            ),
            _OUT,
        ),
    ),
    Stage(
        "certify",
        "compute the losses of designs under random and worst loads of a family",
        kind="certificate",
        inputs=("design",),
        unused=_SHAPE_ONLY,
        threads="loads",
        options=(_file("--other", "NC", "the design of the study itself, to compare with"), _OUT),
        about="Losses go to a journal, from which the same command resumes after any kind of end.",
    ),
    Stage(
        "fabricate",
        "write drawings, meshes and papers of a structure",
        extra="fabrication",
        inputs=("design",),
        unused=(
            *("doc", "report", "prediction", "spectrum"),
            *("response", "sweep", "robustness"),
        ),
        options=(
            option("--structure", choices=_STRUCTURES, required=True, help="what to build"),
            _file("--out-dir", "DIR", "the package", required=True),
        ),
    ),
    Stage(
        "virtual_specimen",
        "simulate the specimen of a virtual recording",
        extra="tracking",
        kind="specimen",
        inputs=("design",),
        unused=(*_APART, "sweep", "robustness", "fabrication"),
        options=(_RECORDING, _OUT),
    ),
    Stage(
        "film",
        "film a simulated response",
        extra="tracking",
        kind="truth",
        parts={
            "render": (
                _RECORDING,
                _DESIGN,
                _RESPONSE,
                _file("--out", "VIDEO", "*.mp4 or *.mkv", required=True),
            ),
            "weigh": (_RECORDING, _RESPONSE, _file("--out", "CSV", "the log", required=True)),
            "plan": (
                option("recording", type=Path, nargs="?", metavar="RECORDING.yaml"),
                _RESPONSE,
                option("--structure", choices=_STRUCTURES),
                option("--case", type=int, help="number of the load case"),
                option("--frames", type=int, default=24, help="of each clip (24)"),
                option("--specimen", nargs="+", choices=("dots", "speckle", "bare")),
                option("--pixels-per-pitch", type=float, nargs="+", metavar="PX"),
                option("--fps", type=float, nargs="+", metavar="HZ"),
                option(
                    "--codec", nargs="+", metavar="NAME", help="ffv1, h264, h264-intra, h264:28"
                ),
                option(
                    "--marker", type=float, nargs="+", metavar="MM", help="diameter of the dots"
                ),
                _file("--csv", "FILE", "also write the table to this file"),
            ),
        },
        about="""\
render writes the video, beside it VIDEO.yaml, which the stage track takes, and VIDEO_truth.nc.
weigh writes the log of the recording's load cell, which is to lie beside the video as
VIDEO_load.csv. Of a recording that has a specimen, both take what virtual_specimen wrote for the
response. plan renders short clips with each of the choices, tracks them, and tells what noise to
expect. Choices that are given several values are tried in every combination.""",
    ),
    Stage(
        "track",
        "turn the video of a specimen into motions of its units",
        extra="tracking",
        kind="track",
        options=(
            option("words", nargs="+", metavar="[COMMAND] FILE", help="what to read"),
            _file("--out", "NC", "dataset to write"),
            _file("--design", "NC", "where the YAML names none"),
            _file("--video", "FILE", "import: the video"),
            option("--pixel-size", type=float, metavar="MM", help="init: roughly"),
            _file("--out-dir", "FOLDER", "of the files", default=Path()),
            option("--no-report", action="store_true", help="no hint at overlay and quality page"),
        ),
        about="""\
  track RECORDING.yaml --out track.nc [--design NC]
  track init VIDEO --design NC [--pixel-size MM] [--out-dir FOLDER]
  track points POINTS.yaml --out track.nc [--design NC]
  track import VIDEO.yaml [--video FILE] [--out-dir FOLDER]

The first also writes track.csv, and tells how an overlay video and a page on quality are made.
The second proposes a recording YAML, draws the units that it found on the first frame, and says
what it could not tell. The third reads the points of a commercial DIC system, a CSV that the YAML
names, instead of a video. The fourth writes NAME_recording.yaml and NAME_design.nc for a described
test video, which the first then tracks.""",
    ),
    Stage(
        "compare",
        "compare a recording with the simulation of what it shows",
        extra="tracking",
        kind="comparison",
        inputs=("design", "response", "track"),
        unused=(*_WORDS, "spectrum", "response", "sweep", "fabrication"),
        threads="copies",
        options=(_file("--recording", "YAML", "what was filmed", required=True), _OUT),
        about="""\
The track is brought into the design's frame and onto the time (or load) of the response by its
drive; the design is simulated under the measured motion of the units that supports and drive hold,
with imperfect copies for a band about it; both sides meet at the frames of the track.""",
    ),
    Stage(
        "calibrate",
        "find stiffness and damping of a specimen from measurements",
        kind="calibration",
        options=(
            option("words", nargs="+", metavar="[COMMAND] FILE", help="what to read"),
            _file("--out", "NC", "dataset to write"),
            _file("--out-dir", "FOLDER", "of the computed files"),
        ),
        about="""\
  calibrate CALIBRATION.yaml --out NC
  calibrate synthesise CALIBRATION.yaml --out-dir FOLDER

The first writes the constants with their errors to NC, and beside it a YAML of the same name: the
lines that a problem file takes. The second computes the sets that the calibration calls virtual,
and writes them with a calibration.yaml that names them, which the first then takes. These are
labelled SYNTHETIC.""",
    ),
    Stage(
        "validate",
        "predict a measured test from others, measure load cycles, track real pictures",
        extra="validation",
        parts={
            "samples": (option("file", type=Path, metavar="POPULATION.yaml"), _OUT),
            "constants": (
                option("file", type=Path, metavar="POPULATION.yaml"),
                option("--count", type=int, default=200, help="of the draws (200)"),
                _file("--out", "CSV", "constants of new samples, a draw a line", required=True),
            ),
            "cycles": (option("file", type=Path, metavar="LOAD_CYCLES.yaml"), _OUT),
            "pictures": (option("file", type=Path, metavar="PICTURES.yaml"), _OUT),
        },
    ),
    Stage(
        "markers",
        "write sheets of marks for the tracking, to print and stick on the units",
        extra="tracking",
        home="pipeline.virtual_lab",
        module_name="print_markers",
        inputs=("design",),
        options=(
            option("--structure", choices=_STRUCTURES, default="cloaked"),
            _file("--out", "PDF", "the sheets", required=True),
            option("--kind", choices=("dots", "speckle"), default="dots"),
            option("--count", type=int, choices=(1, 2, 3), default=3, help="dots per unit (3)"),
            option("--diameter", type=float, metavar="MM", help="of a dot (2) or speckle (1.2)"),
            option("--spread", type=float, default=7.0, metavar="MM", help="of the dots (7)"),
            option("--faces", choices=("dark", "light"), default="dark", help="under the marks"),
            option("--paper", choices=("A4", "Letter"), default="A4"),
        ),
    ),
    Stage(
        "new",
        "make experiments/NAME/problem.yaml, commented and ready to build",
        home="pipeline.workflow",
        module_name="new_study",
        options=(
            option("name", help="of the study: letters, digits and underscores"),
            option(
                *("--kind",),
                choices=("static", "dynamic"),
                default="static",
                help="a void under slow compression, or a shaken unit (default: %(default)s)",
            ),
            _file("--image", "FILE", "shape of the void (PNG, JPG, SVG); is copied"),
            option(
                *("--threshold",),
                type=float,
                help="grey level, 0 (black) to 1 (white), below which a pixel is in the shape",
            ),
            option(
                *("--invert",),
                action="store_true",
                help="the shape is light on a dark ground",
            ),
            _file(
                *("--folder", "DIR", "where the studies are (default: %(default)s)"),
                default=Path("experiments"),
            ),
        ),
    ),
    Stage(
        "check",
        "show a study before it is computed: picture, cost, and what may not be meant",
        home="pipeline.workflow",
        module_name="first_look",
        options=(option("study", metavar="STUDY", help="such as fig2 or fig2@quick"),),
        about="Runs by itself before a design is computed.",
    ),
    Stage(
        "run",
        "build targets, such as fig2 or fig2@quick, with all that they need",
        home="pipeline.workflow",
        options=(option("words", nargs="*", metavar="TARGET", help="or options of snakemake"),),
        passes_on=True,
        about="Goes on where a run ended, whatever ended it.",
    ),
    Stage(
        "reproduce",
        "build a target twice from nothing and compare all bytes",
        home="pipeline.workflow",
        options=(option("target", nargs="?", default="fig2@quick", help="(%(default)s)"),),
    ),
    Stage(
        "publish",
        "write a built study as an RO-Crate, from which it can be built again",
        home="pipeline.workflow",
        extra="publish",
        options=(
            option("target", help="a study that is built, such as fig2 or fig2@quick"),
            _file("--out-dir", "DIR", "the crate (default: results/TARGET_crate)"),
        ),
        about="Sources, locks, problem, datasets, figures and licences, as a Workflow Run Crate.",
    ),
    Stage(
        "schema",
        "write the JSON schema of problem files, for editors",
        home="pipeline.workflow",
        module_name="problem_schema",
        options=(
            _file(
                *("--out", "FILE", "the file to write (default: %(default)s)"),
                default=Path("experiments/problem.schema.json"),
            ),
        ),
    ),
    Stage(
        "reference",
        "write the pages of the documentation that follow from the code",
        home="pipeline.workflow.reference",
        module_name="write_pages",
        options=(
            _file(
                *("--folder", "DIR", "where they go (default: %(default)s)"), default=Path("docs")
            ),
        ),
    ),
)

STAGES: Mapping[str, Stage] = {row.name: row for row in _ROWS}
"""The rows by name."""

REPORTED: Mapping[str, Stage] = {name: row for row in _ROWS for name in row.datasets}
"""The stages by the datasets that a study's report reads."""
