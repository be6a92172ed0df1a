from pathlib import Path

import pytest

from pipeline.problem import content_hash, section_hash
from pipeline.problem.reading import load
from pipeline.problem.sections import design_name
from pipeline.problem.sections.designs import split_name
from pipeline.runtime import ROOT
from pipeline.workflow.studies import Study, families, together
from tests.pipeline import static
from tests.pipeline.conftest import Failing
from tests.tables import refused

FIG3 = ROOT / "experiments/fig3/problem.yaml"
TWO = "designs: { cloak.disc.radius: [20 mm, 22 mm] }\n"


def test_a_name_is_a_preset_and_a_number() -> None:
    assert split_name("quick") == ("quick", None)
    assert split_name("quick.2") == ("quick", 2)
    assert split_name("2") == (None, 2)
    assert split_name(None) == (None, None)
    assert [design_name("quick", 2), design_name("", 2)] == ["quick.2", "2"]


def test_a_design_is_the_problem_with_its_value(tmp_path: Path) -> None:
    one = load(static.write(tmp_path, static.HOLE + TWO), "2")
    alone = load(static.write(tmp_path, static.HOLE))
    assert one.designs is None
    assert content_hash(one) == content_hash(alone)


def test_designs_differ_by_the_cloak_alone() -> None:
    designs = [load(FIG3, str(number)) for number in range(1, 5)]
    radii = [one.cloak.disc.radius for one in designs if one.cloak.disc is not None]
    assert radii == [37.5, 67.5, 97.5, 127.5]
    assert len({section_hash(one, "design") for one in designs}) == 4
    assert {one.material for one in designs} == {designs[0].material}
    assert load(FIG3, "quick.2").lattice.columns == 9


@pytest.mark.parametrize(("name", "remedy"), [("5", "from 1 to 4"), ("quick.3", "from 1 to 2")])
def test_a_design_that_is_not_there(name: str, remedy: str) -> None:
    with refused("no design number", remedy=remedy):
        load(FIG3, name)


def test_the_workflow_knows_them() -> None:
    designs = [Study("fig3", f"quick.{number}") for number in (1, 2)]
    assert families()[Study("fig3", "quick")] == together()["fig3@quick"] == designs
    assert [str(study) for study in together()["fig3"]] == ["fig3@1", "fig3@2", "fig3@3", "fig3@4"]


def test_one_of_several_has_to_be_named(tmp_path: Path, failing: Failing) -> None:
    path = static.write(tmp_path, static.HOLE + TWO)
    words = ["--problem", str(path), "--method", "sqp", "--out", str(tmp_path / "x.nc")]
    assert "--preset 1" in failing("design", words)
