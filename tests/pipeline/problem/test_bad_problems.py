"""Every mistake in a problem file is told with its key, its value and a remedy."""

import re
from pathlib import Path

import pytest

from pipeline.problem.reading import load, preset_names
from pipeline.runtime import UserError
from tests.pipeline.conftest import Refusal

# An edit of Figure 2's problem, the key that the error names, what it says, and its remedy.
TABLE = r"""
spacing: => spacng: | lattice.spacng | unknown key | did you mean 'spacing'?
directions: [0 deg, 45 deg, 90 deg, 135 deg] => directions: [0 deg]\n  rotation: 10 deg
    | drive.rotation | unknown key | `kind: rotation`
objective: => goal: | goal | unknown key | known here: title, doc, lattice
  rows: 15\n =>  | lattice.rows | missing key | add it
spacing: 15 mm => spacing: 15 | lattice.spacing | the unit is missing | "15 mm"
radius: 67.5 mm => radius: 4.5 s
    | cloak.disc.radius | the unit 's' is not that of a length | a length is wanted here
spacing: 15 mm => spacing: .nan | lattice.spacing | not a number with a unit | mm
spacing: 15 mm => spacing: 1e300 mm | lattice.spacing | no specimen has 1e+300 mm | check number
axial_stiffness: 120 N/mm => axial_stiffness: -120 N/mm
    | material.axial_stiffness | a stiffness must be greater than zero
    | give a value greater than zero
edge_length: 5 mm => edge_length: -5 mm
    | constraints.edge_length | a length must be greater than zero | greater than zero
ratio: 0.0186 => ratio: -1 | material.damping.ratio | too small | at least 0
ratio: 0.0186 => ratio: .inf | material.damping.ratio | not a finite number | finite
ratio: 0.0186 => translation: 1 kg/s
    | material.damping | one form of damping is wanted | give ratio, or translation and rotation
periods: 2 => periods: 2\n  duration: 1 s
    | horizon | periods and duration exclude each other | exactly one
columns: 15 => columns: 15.5 | lattice.columns | not a whole number | whole
columns: 15 => columns: 0 | lattice.columns | too small | at least 1
kind: harmonic => kind: harmonics | drive | unknown kind | 'ramp_harmonic'
  kind: harmonic =>   # kind | drive | the key `kind` is missing | add it
accuracy: default => accuracy: best | solver.accuracy | not one of the | 'tight'
units: centre => units: middle | drive.units | not one of the choices | 'centre'
weights: [0.25, 0.25, 0.25, 0.25] => weights: [0.5, 0.5]
    | drive.weights | 2 weights for 4 directions | one weight per direction
weights: [0.25, 0.25, 0.25, 0.25] => weights: [1, 1, 1, 1]
    | drive.weights | the weights add up to 4 | scale them to add up to 1
radius: 67.5 mm => radius: 130 mm
    | cloak.disc.radius | cloak of radius 130 mm reaches beyond the lattice
    | within 112.5 mm of its centre (105, 105) mm
centre: centre => centre: [200 mm, 105 mm]
    | cloak.disc.radius | reaches beyond the lattice | within 17.5 mm
centre: centre => centre: [105 mm, 1 m]
    | cloak.disc.centre | the centre of the cloak lies outside the lattice | span 210 by 210 mm
radius: 67.5 mm => radius: 10 mm | cloak | no unit lies in the cloak | enlarge it
  disc:\n    centre: centre\n    radius: 67.5 mm =>   ring:\n    inner: 60 mm\n    outer: 50 mm
    | cloak.ring.inner | inner radius (60 mm) is not below the outer (50 mm) | keep it below 50 mm
region: surroundings => region: { disc: { radius: 7 mm, centre: [7.5 mm, 7.5 mm] } }
    | objective.region | no unit lies in the region of interest |
edge_length: 5 mm => edge_length: 10 mm
    | constraints.edge_length | infeasible at the start: the undeformed units have 9.59421 mm
    | at most 9.59 mm
block_angle: 30 deg => block_angle: 91 deg
    | constraints.block_angle | infeasible at the start | at most 90 deg
void_angle: 0 deg => void_angle: 51 deg
    | constraints.void_angle | infeasible at the start | at most 50 deg
gap: 0.2 mm => gap: 3 mm | constraints.gap | infeasible at the start | 2.25 mm
units: centre => units: { units: [[14, 0]] }
    | drive.units | unit [14, 0] is driven and clamped | drive or clamp it, not both
units: corners => units: { units: [[15, 0]] }
    | supports[0].units | unit [15, 0] is not in the lattice | i runs to 14
columns: 15 => columns: 14 | drive.units | a lattice of even size has no centre unit | i runs to 13
barrier_angle: -15 deg => barrier_angle: -5 deg
    | contact.barrier_angle | the barrier (-5 deg) is not below the cut-off (-10 deg)
    | below -10 deg
cutoff_angle: -10 deg => cutoff_angle: 60 deg
    | contact.cutoff_angle | the undeformed lattice is in contact | below 50 deg
ligament_length: 2.25 mm => ligament_length: 15 mm
    | lattice.ligament_length | leave no room for units | below the spacing
bias_angle: 20 deg => bias_angle: 50 deg | lattice.bias_angle | closes | 45 deg
symmetry: C4 => symmetry: C3 | optimiser.symmetry | not one of the | 'C4'
trust_radius: 0.25 mm => trust_radius: 5 mm
    | optimiser.trust_radius | larger than its maximum | at or below 1 mm
to: 180 deg => to: 0 deg | sweep.grid.drive.directions.to | do not ascend | above `from`
to: 180 deg => to: 3 rad | sweep.grid.drive.directions | in several units | in the same unit
drive.frequency: { => drive.freqency: {
    | sweep.grid.drive.freqency | unknown key | did you mean 'frequency'
from: 2 Hz, to: 16 Hz => from: 2, to: 16 | sweep.grid.drive.frequency | the unit is missing | 2 Hz
samples: 200 => samples: 1 | horizon.samples | too small | at least 2
samples: 200 => samples: 1000000000 | horizon.samples | too large | at most 1000000
convex: true => convex: maybe | constraints.convex | neither true nor false | true
title: Shielding => title: 3 # | title | not a text | quotes
"""
MISTAKES = [
    [cell.replace(r"\n", "\n") for cell in re.split(r" => | \| ?", row)]
    for row in re.sub(r"\n +\|", " |", TABLE).strip("\n").split("\n")
]


@pytest.mark.parametrize(("old", "new", "key", "what", "remedy"), MISTAKES)
def test_a_mistake_is_told(
    refusal: Refusal, old: str, new: str, key: str, what: str, remedy: str
) -> None:
    error = refusal(old, new)
    assert what in error.what
    assert error.key == key
    assert remedy in str(error.remedy)
    assert error.line is not None


def test_line_and_value_are_those_of_the_file(refusal: Refusal, fig2: Path) -> None:
    error = refusal("axial_stiffness: 120 N/mm", "axial_stiffness: -120 N/mm")
    lines = fig2.read_text(encoding="utf-8").splitlines()
    assert error.line == 1 + next(
        index for index, line in enumerate(lines) if "axial_stiffness" in line
    )
    assert error.value == "-120 N/mm"


def test_the_message_fits_a_screen(refusal: Refusal) -> None:
    error = refusal("spacing: 15 mm", f"spacing: {'9' * 5000} m m m")
    assert max(map(len, str(error).splitlines())) < 200


def test_a_fault_in_a_preset_is_found_there(refusal: Refusal, fig2: Path) -> None:
    error = refusal("edge_length: 3 mm", "edge_length: 30 mm", "edge3")
    assert error.key == "presets.edge3.constraints.edge_length"
    lines = fig2.read_text(encoding="utf-8").splitlines()
    assert error.line == 1 + lines.index(
        next(line for line in lines if "edge_length: 3 mm" in line)
    )


def test_an_unknown_preset_lists_those_there_are(fig2: Path) -> None:
    with pytest.raises(UserError, match="no preset 'quik'") as caught:
        load(fig2, "quik")
    told = f"did you mean 'quick'? presets here: {', '.join(preset_names(fig2))}"
    assert caught.value.remedy == told


def test_presets_are_mappings(refusal: Refusal) -> None:
    assert refusal("\npresets:", "\npresets: 3\nrest:", "quick").key == "presets"
    assert refusal("  edge3:\n    title", "  edge3: 3\n  x:\n    title", "edge3").line is not None


@pytest.mark.parametrize(
    ("text", "what", "line"),
    [
        ("lattice: [1, 2\nrows: 3\n", "not valid YAML", 2),
        ("a:\n\tb: 1\n", "not valid YAML", 2),
        ("a: 1\nb: 2\na: 3\n", "the key 'a' is given twice", 3),
        ("a: &x 1\nb: *x\n", "aliases (*name) are not supported", 2),
        ("a: !!python/object:os.system {}\n", "not valid YAML", 1),
        ("- 1\n- 2\n", "does not hold keys and values", None),
        ("just words\n", "does not hold keys and values", None),
        ("", "does not hold keys and values", None),
        ("a: \x07\n", "not YAML", None),
        ("? [1, 2]\n: 3\n", "a key must be one word", 1),
        ("[" * 5000, "nested too deeply", None),
        ("a: " + "x" * 300_000, "more than 262144", None),
        ("---\na: 1\n---\nb: 2\n", "not valid YAML", 3),
    ],
)
def test_text_that_is_no_problem(tmp_path: Path, text: str, what: str, line: int | None) -> None:
    path = tmp_path / "problem.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError) as caught:
        load(path)
    assert what in caught.value.what
    assert caught.value.remedy
    if line is not None:
        assert caught.value.line == line


def test_a_file_must_be_there_and_be_text(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        load(tmp_path / "none.yaml")
    with pytest.raises(UserError, match="a folder"):
        load(tmp_path)
    (tmp_path / "latin.yaml").write_bytes(b"title: \xe4\n")
    with pytest.raises(UserError, match="not a UTF-8 text"):
        load(tmp_path / "latin.yaml")
