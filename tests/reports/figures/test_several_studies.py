import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import problem
from pipeline.problem import Output
from pipeline.problem.reading import JointFigure, joint_figure
from pipeline.runtime import UserError
from reports.__main__ import main
from reports.base import style
from reports.figures.several_studies import figure
from reports.figures.several_studies.several_studies_report import (
    load,
    refuse_unlike,
    several_studies_report,
)
from reports.page import publish
from reports.study import StudyResults
from tests.reports import compressed_study, figure_assertions
from tests.tables import cases, refused, some

UNLIKE = [("lattice", {"columns": 9}), ("drive", {"amplitude": 3.0}), ("objective", {"kind": "x"})]
ASKED = JointFigure(title="Two voids", studies=("fig_smile", "fig_frown"))


@pytest.fixture(scope="module")
def pair(smile: StudyResults) -> list[StudyResults]:
    return [dataclasses.replace(smile, name=name) for name in ASKED.studies]


@pytest.fixture(scope="module")
def report(pair: list[StudyResults], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("joint")
    publish(several_studies_report("fig", ASKED, pair), folder)
    return folder


@pytest.mark.parametrize("count", some([4, 1, 2, 3], 1))
def test_it_is_legible_with_any_number_of_studies(pair: list[StudyResults], count: int) -> None:
    with style.styled():
        made = figure_assertions.drawn(figure.several_studies_figure((pair * 2)[:count]).draw())
    figure_assertions.assert_legible(made)
    words = figure_assertions.words(made)
    assert {"Intact", "Voided", "Cloaked", "Smile"} <= words
    assert set("abcdefghijkl"[: -(-count // 2) + 3 * count]) <= words


@pytest.mark.parametrize(("count", "loads", "told"), [(2, 2, 2), (2, 4, 4), (4, 4, 1)])
def test_structures_are_shown_under_every_load_or_the_one_shown_is_told(
    smile: StudyResults, count: int, loads: int, told: int
) -> None:
    study = under_loads(smile, loads)
    with style.styled():
        made = figure.several_studies_figure([study] * count)
        page = figure_assertions.drawn(made.draw())
    figure_assertions.assert_legible(page)
    words = "\n".join(text.get_text() for text in page.texts)
    names = ["compression 180°", "extension 0°", "shear 90°", "shear 270°"][:loads]
    assert [name for name in names if name in words] == names[:told]
    assert ("Of the load cases the first one, compression 180°" in made.caption) == (told < loads)
    (legend,) = page.legends
    entries = {text.get_text() for text in legend.get_texts()}
    assert {f"Cloaked, {name}" for name in names} <= entries


def under_loads(study: StudyResults, count: int) -> StudyResults:
    """The study with its one load case as that of several directions."""
    degrees = [180.0, 0.0, 90.0, 270.0][:count]
    response = xr.concat([study.response] * count, "case", data_vars="minimal", coords="minimal")
    response = response.assign_coords(direction=("case", degrees))
    drive = study.problem.drive.model_copy(
        update={"directions": tuple(np.radians(degrees)), "weights": None}
    )
    posed = study.problem.model_copy(update={"drive": drive})
    made = response.assign_attrs(study.response.attrs)
    datasets: dict[Output, xr.Dataset] = {"design": study.design, "response": made}
    return dataclasses.replace(study, problem=posed, datasets=datasets)


def test_the_page_tells_each_study_and_shows_each_structure_once(report: Path) -> None:
    found = {fact["key"]: fact for fact in json.loads((report / "facts.json").read_text())}
    assert found["fig_smile.mismatch_reduction"]["group"] == "Smile: Result"
    assert found["fig_frown.mismatch_reduction"]["group"] == "Frown: Result"
    with (report / "fig_frown_path.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 9
    html = (report / "index.html").read_text(encoding="utf-8")
    data = html.partition('id="player-data">')[2].partition("</script>")[0]
    names = [part["name"] for part in json.loads(data.replace("<\\/", "</"))["structures"]]
    assert names == [
        "Intact", "Smile: voided", "Smile: cloaked", "Frown: voided", "Frown: cloaked",
    ]  # fmt: skip


def test_the_caption_tells_of_every_panel_in_its_order(pair: list[StudyResults]) -> None:
    made = figure.several_studies_figure(pair)
    assert all(panel.head[1] and panel.caption for panel in made.panels)
    told = [
        "<b>a</b> The intact", "<b>b</b> Smile, without", "<b>c</b> Frown, without",
        "<b>d</b> Smile: mimicking error", "<b>e</b> Smile: how much nearer",
        "<b>f</b> Frown: mimicking error", "<b>g</b> Frown: how much nearer", "true to scale",
    ]  # fmt: skip
    places = [made.caption.index(words) for words in told]
    assert places == sorted(places)
    assert several_studies_report("fig", ASKED, pair).values["caption"] == made.caption


def test_warnings_bear_the_study_that_they_are_of(pair: list[StudyResults]) -> None:
    """Names none where they are of all."""
    warned = [
        _planned(pair[0], skipped=["the sweep"], warnings=["both", "a soft unit"]),
        _planned(pair[1], skipped=[], warnings=["both"]),
    ]
    told = several_studies_report("fig", ASKED, warned).values
    assert told["warnings"][:2] == ["both", "fig_smile: a soft unit"]
    assert told["skipped"] == ["fig_smile: the sweep"]
    alone = several_studies_report("fig", ASKED, warned[:1]).values
    assert alone["warnings"][:2] == ["both", "a soft unit"]


def _planned(study: StudyResults, **told: list[str]) -> StudyResults:
    plans = dict.fromkeys(json.loads(study.response.attrs["plan"]), told)
    response = study.response.assign_attrs(plan=json.dumps(plans))
    return dataclasses.replace(study, datasets={**study.datasets, "response": response})


@pytest.mark.slow
def test_command_line(tmp_path: Path) -> None:
    experiments = tmp_path / "experiments"
    for name in (*ASKED.studies, "fig"):
        (experiments / name).mkdir(parents=True)
    for name in ASKED.studies:
        compressed_study.written(experiments / name, compressed_study.SMILE)
    asked = experiments / "fig" / "figure.yaml"
    asked.write_text("title: Two voids\nstudies: [fig_smile, fig_frown]\n")
    words = ["--figure", str(asked), "--results", str(experiments)]
    assert main(["several-studies", *words, "--out-dir", str(tmp_path / "report")]) == 0
    names = {path.name for path in (tmp_path / "report").iterdir()}
    assert {"fig.pdf", "fig.svg", "fig.png", "index.html", "fig_frown_robustness.csv"} <= names


def test_the_committed_figure_names_studies() -> None:
    path = Path(__file__).parents[3] / "experiments/fig6/figure.yaml"
    assert joint_figure.load_joint_figure(path).studies == ("fig6_heart", "fig6_shamrock")


@cases("reports", "text, told")
def test_a_faulty_figure_is_told(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "figure.yaml").write_text(text)
    with pytest.raises(UserError, match=told):
        joint_figure.load_joint_figure(tmp_path / "figure.yaml")


@pytest.mark.parametrize(("key", "update"), UNLIKE)
def test_an_unlike_study_is_refused(
    pair: list[StudyResults], key: str, update: dict[str, object]
) -> None:
    first, second = pair
    asked = second.problem
    section = getattr(asked, key).model_copy(update=update)
    other = dataclasses.replace(second, problem=asked.model_copy(update={key: section}))
    refuse_unlike(second, first, Path("figure.yaml"))
    with refused("fig_frown and fig_smile differ", "studies", key, Path("figure.yaml")):
        refuse_unlike(other, first, Path("figure.yaml"))


def test_the_committed_studies_are_alike(smile: StudyResults) -> None:
    folder = Path(__file__).parents[3] / "experiments"
    heart, shamrock = (
        dataclasses.replace(smile, problem=problem.load(folder / name / "problem.yaml"))
        for name in ("fig6_heart", "fig6_shamrock")
    )
    refuse_unlike(shamrock, heart, folder / "fig6/figure.yaml")


def test_a_shaken_study_has_no_place_in_it(tmp_path: Path) -> None:
    path = Path(__file__).parents[3] / "experiments/fig2/figure.yaml"
    with pytest.raises(UserError, match="no such dataset"):
        load(path, JointFigure(studies=("fig2",)), None, tmp_path)
