import json
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel

from pipeline.posing import limits_of, scene_of
from pipeline.problem import Problem, canonical_json, from_canonical, section_hash
from pipeline.problem.reading import load
from pipeline.runtime import ROOT, STAGES
from tests.pipeline import static

OWN = {
    "simulate": {"response"},
    "as_built": {"response", "fabrication"},
    "verify": {"response"},
    "virtual_specimen": {"response"},
    "sweep": {"sweep"},
    "monte_carlo": {"robustness"},
    "spectrum": {"spectrum"},
    "fabricate": {"title", "fabrication"},
    "compare": {"robustness", "prediction"},
}
"""The sections that are for some stages alone."""
OF_PROBLEM = [name for name, stage in STAGES.items() if stage.unused is not None]


@pytest.fixture(scope="module")
def read_to_pose() -> set[str]:
    """Lists the sections that are read to pose what any study simulates, as its loss takes it."""
    read: set[str] = set()
    usual = Problem.__getattribute__

    def spy(problem: Problem, name: str) -> object:
        if name in Problem.model_fields:
            read.add(name)
        return usual(problem, name)

    with pytest.MonkeyPatch.context() as patch:
        for name in ("fig2", "fig4", "fig5", "rigid_inclusion"):
            path = ROOT / f"experiments/{name}/problem.yaml"
            problem = load(path)
            patch.setattr(Problem, "__getattribute__", spy)
            scene_of(problem, path.parent)
            limits_of(problem)
            patch.undo()
    return read


RANGES = ", loads: { directions: [90 deg, 270 deg] }"


@pytest.mark.parametrize(("more", "alike"), [("", False), (", snap: avoid", False), (RANGES, True)])
def test_a_design_depends_on_the_loads_that_are_shown_where_they_confirm_it(
    more: str, alike: bool, tmp_path: Path
) -> None:
    """The check by finer steps replaces them."""
    path = static.write(tmp_path, static.HOLE, size=5)
    text = path.read_text().replace("target: intact", f"target: intact{more}")
    hashes = []
    for samples in (9, 21):
        path.write_text(text.replace("samples: 9", f"samples: {samples}"))
        stages = ("design", "redesign", "verify")
        hashes.append([section_hash(load(path), name) for name in stages])
    same = [one == other for one, other in zip(*hashes, strict=True)]
    assert same == [alike, alike, True]


def others(section: BaseModel, path: str = "") -> Iterator[tuple[str, BaseModel]]:
    """Yields, key by key, a section in which that key alone has another value."""
    for name in type(section).model_fields:
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            parts: Iterable[tuple[str, object]] = others(value, f"{path}{name}.")
        elif isinstance(value, tuple) and any(isinstance(each, BaseModel) for each in value):
            parts = [
                (key, (*value[:at], other, *value[at + 1 :]))
                for at, each in enumerate(value)
                for key, other in others(each, f"{path}{name}.{at}.")
            ]
        else:
            parts = [(f"{path}{name}", "another")]
        for key, other in parts:
            yield key, section.model_copy(update={name: other})


@pytest.fixture(scope="module")
def keys_of_stages() -> dict[str, dict[str, bool]]:
    """Tells by stage and key of a problem if the stage runs again where that key is another."""
    found: dict[str, dict[str, bool]] = {stage: {} for stage in ("report", *OF_PROBLEM)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a value that is a text
        problem = load(ROOT / "experiments/fig2/problem.yaml")
        before = {stage: section_hash(problem, stage) for stage in found}
        for key, other in others(problem):
            assert isinstance(other, Problem)
            for stage, seen in found.items():
                seen[key] = section_hash(other, stage) != before[stage]
    return found


DRAWN = ("minimum_wall", "minimum_gap", "fillet_radius", "slots.", "shims.thickness")
"""Of the fabrication, what the slots depend on by which shims are bent."""


@pytest.mark.parametrize("stage", OF_PROBLEM)
def test_a_stage_depends_on_every_key_of_the_sections_that_it_reads(
    stage: str, keys_of_stages: dict[str, dict[str, bool]], read_to_pose: set[str]
) -> None:
    """Those that pose a scene, the optimiser, and the stage's own: no more and no fewer."""
    assert read_to_pose > {"lattice", "material", "contact", "supports", "drive", "solver", "void"}
    wanted = read_to_pose | {"optimiser", "designs"} | OWN.get(stage, set())
    wrong = {
        key: changed
        for key, changed in keys_of_stages[stage].items()
        if changed != (key.partition(".")[0] in wanted)
    }
    later = [] if stage == "redesign" else ["optimiser.geometric.evaluations"]
    if stage == "as_built":
        made = (key for key in keys_of_stages[stage] if key.startswith("fabrication."))
        later += [key for key in made if not key.removeprefix("fabrication.").startswith(DRAWN)]
    assert wrong == dict.fromkeys(later, False)


def test_a_page_depends_on_every_key(keys_of_stages: dict[str, dict[str, bool]]) -> None:
    assert len(keys_of_stages["report"]) > 140
    assert all(keys_of_stages["report"].values())


@pytest.mark.parametrize(
    ("key", "value", "matters"),
    [
        ("labels", {"depth": "0.3 mm"}, False),
        ("shims", {"tabs": None, "young_modulus": "3 GPa"}, False),
        ("slots", {"depth_min": "0.5 mm"}, True),
    ],
)
def test_structures_as_built_depend_on_how_slots_are_drawn(
    tmp_path: Path, key: str, value: object, matters: bool
) -> None:
    path = static.write(tmp_path, static.HOLE, size=5)
    content = yaml.safe_load(path.read_text())
    made = content.setdefault("fabrication", {}) | {"laser": {"kerf": "0.05 mm"}}
    content["fabrication"], before = made | {key: value}, load(path)
    path.write_text(json.dumps(content))
    after = load(path)
    assert (section_hash(after, "as_built") != section_hash(before, "as_built")) == matters
    kept = from_canonical(canonical_json(after, "as_built")).fabrication
    assert (kept.slots, kept.slot_room) == (after.fabrication.slots, after.fabrication.slot_room)
