from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.runtime import UserError
from reports.base import style
from reports.facts import Fact
from reports.figures import kinds
from reports.figures.study_report import study_report
from reports.page import rendered
from reports.panels import payload
from reports.study import StudyResults
from reports.study.study_results import load
from tests.reports import compressed_study, figure_assertions, recorded_study
from tests.reports.panels.test_animation_data import decoded


@pytest.fixture(scope="module")
def filmed(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, StudyResults]:
    structures = {
        "study": (("altered", 1), ("cloaked", 1)),
        "shield": (("altered", 0), ("cloaked", 0)),
        "smile": (("intact", 0), ("altered", 0), ("cloaked", 0)),
    }
    return {
        name: recorded_study.with_recordings(
            request.getfixturevalue(name), tmp_path_factory.mktemp(name), *shown
        )
        for name, shown in structures.items()
    }


@pytest.fixture(scope="module")
def figures(filmed: dict[str, StudyResults]) -> dict[str, Figure]:
    with style.styled():
        return {
            name: figure_assertions.drawn(kinds.kind_of(study.problem).figure(study).draw())
            for name, study in filmed.items()
        }


@pytest.mark.parametrize("name", ["study", "shield", "smile"])
def test_figures_show_experiments_above_and_dashed(name: str, figures: dict[str, Figure]) -> None:
    made = figures[name]
    figure_assertions.assert_legible(made)
    places = {text.get_text(): text.get_position() for text in figure_assertions.texts(made)}
    labels = [text for text in places if SYNTHETIC_LABEL in text and "\n" in text]
    assert len(labels) >= 2
    for label in labels:
        beside = f"{label.splitlines()[0]}\nsimulation"
        (x, y), (right, below) = places[label], places[beside]
        assert y > below or x < right
    lines = [line for axes in made.axes for line in axes.lines if line.get_marker() == "o"]
    dashed = {line.get_color() for line in lines if line.is_dashed()}
    assert dashed >= {style.ALTERED, style.CLOAKED}


def facts(study: StudyResults) -> dict[str, Fact]:
    return {fact.key: fact for fact in kinds.kind_of(study.problem).facts(study)}


@pytest.mark.parametrize(
    ("name", "key", "case"), [("study", "peak_to_peak", 1), ("shield", "rotation", 0)]
)
def test_takes_of_one_test_are_told_apart(
    filmed: dict[str, StudyResults], name: str, key: str, case: int
) -> None:
    """The second one moves half as much; the only one without a cloak stands beside both."""
    study, doubled = filmed[name], f"cloaked_{case}"
    half = study.compared[doubled].copy(deep=True)
    for variable in ("measured", "peak_to_peak"):
        half[variable] = 0.5 * half[variable]
    twice = replace(study, compared={**study.compared, f"{doubled}_again": half})
    assert [each.take for each in twice.recordings] == [0, 1, 2]
    told = kinds.kind_of(twice.problem).facts(twice)
    keys = [fact.key for fact in told if fact.key.startswith("measured_")]
    assert len(set(keys)) == len(keys)
    before, known = facts(study), {fact.key: fact for fact in told}
    for ending, factor in (("", 1.0), ("_take2", 0.5)):
        fact = known[f"measured_{key}_cloaked{ending}"]
        assert fact.value == pytest.approx(factor * before[f"measured_{key}_cloaked"].value)
        assert ", take" in fact.label
        gain = known[f"measured_{key}_reduction{ending}"].value
        left = 100.0 - before[f"measured_{key}_reduction"].value
        assert gain == pytest.approx(100.0 - factor * left)
    assert ", take" not in known[f"measured_{key}_altered"].label


def test_measured_motions_are_told(filmed: dict[str, StudyResults]) -> None:
    shaken, shield, smile = (facts(filmed[name]) for name in ("study", "shield", "smile"))
    for name in ("altered", "cloaked"):
        value = shaken[f"peak_to_peak_{name}"].value
        measured = shaken[f"measured_peak_to_peak_{name}"]
        assert measured.value == pytest.approx(recorded_study.GAIN * value, rel=0.02)
        assert SYNTHETIC_LABEL in measured.note
    assert shaken["measured_peak_to_peak_reduction"].value == pytest.approx(88.0, abs=0.1)
    for key in ("rotation_altered", "rotation_cloaked_most"):
        expected = pytest.approx(recorded_study.GAIN * shield[key].value, rel=0.02)
        assert shield[f"measured_{key}"].value == expected
    expected = pytest.approx(recorded_study.GAIN * smile["contraction_intact"].value, rel=1e-6)
    assert smile["measured_contraction_intact"].value == expected
    error = smile["contraction_error_altered"].value
    assert smile["measured_contraction_error_altered"].value == pytest.approx(error, rel=1e-6)
    study = filmed["shield"]
    found = facts(study)
    assert found["altered_0_rmse_ux"].value == 0.5
    assert found["altered_0_frames"].value == len(study.recordings[0].along)
    assert (
        found["altered_0_correlation"].group
        == f"Recording “altered_0”: experiment ({SYNTHETIC_LABEL})"
    )


def test_the_player_shows_it_and_the_residual(filmed: dict[str, StudyResults]) -> None:
    study = filmed["study"]
    data = payload(kinds.kind_of(study.problem).animation(study))
    names = [clip["name"] for clip in data["structures"]]
    assert names[:2] == [f"Altered, experiment ({SYNTHETIC_LABEL})", "Altered"]
    cases = data["motion"][0]
    assert [case is not None for case in cases] == [False, True, False, False]
    assert data["residual"][1] == []
    shape = (-1, 225, 3)
    measured, apart = (
        decoded(part["data"], "<i2").reshape(shape) * np.array(part["step"])
        for part in (cases[1], data["residual"][0][1])
    )
    lost = np.all(np.abs(measured[5] / cases[1]["step"] + 32768) < 0.5, axis=1)
    assert np.flatnonzero(lost).tolist() == [recorded_study.LOST]
    residual = measured[5, ~lost] * (1 - 1 / recorded_study.GAIN)
    np.testing.assert_allclose(apart[5, ~lost], residual, atol=2e-4)
    assert all(field["residual"] for field in data["fields"])


def test_pages_say_that_it_is_synthetic_unless_filmed(filmed: dict[str, StudyResults]) -> None:
    study = filmed["smile"]
    html = rendered(study_report(study), {})
    assert f"<b>{SYNTHETIC_LABEL}</b>: these recordings were rendered" in html
    assert html.count(f" <strong>{SYNTHETIC_LABEL}</strong></li>") == len(study.recordings) > 1
    real = {name: data.assign_attrs(synthetic="no") for name, data in study.compared.items()}
    assert SYNTHETIC_LABEL not in rendered(study_report(replace(study, compared=real)), {})


def test_only_the_way_there_is_shown_of_a_load(filmed: dict[str, StudyResults]) -> None:
    recording = filmed["shield"].recordings[0]
    assert len(recording.along) < recording.data.sizes["time"]
    assert np.all(np.diff(recording.along) >= 0)
    beyond = recording.at(recording.data["measured"], np.array([7.5, 30.0]))
    assert np.isfinite(beyond[0, 0]).all()
    assert np.isnan(beyond[1]).all()


def test_comparisons_are_read_from_their_folders(tmp_path: Path) -> None:
    made = recorded_study.with_recordings(
        compressed_study.written(tmp_path, compressed_study.SHIELD), tmp_path, ("altered", 0)
    )
    files = {kind: tmp_path / f"{kind}.nc" for kind in made.datasets}
    file = tmp_path / "altered_0/comparison.nc"
    read = load(tmp_path / "problem.yaml", None, files, [file])
    assert list(read.compared) == ["altered_0"]
    assert "recordings/altered_0/comparison.nc" in read.files
    problem = tmp_path / "problem.yaml"
    problem.write_text(problem.read_text() + "prediction: { samples: 3 }\n")
    with pytest.raises(UserError, match=r"made from another problem[\s\S]*comparison\.nc"):
        load(problem, None, files, [file])


def test_a_missing_dataset_is_asked_for_by_its_option(tmp_path: Path) -> None:
    made = compressed_study.written(tmp_path, compressed_study.SHIELD)
    files = {kind: tmp_path / f"{kind}.nc" for kind in made.datasets if "geometric" not in kind}
    with pytest.raises(UserError) as error:
        load(tmp_path / "problem.yaml", None, files)
    assert error.value.remedy == "give it as --geometric-design"


def test_pixels_are_told_over_those_stated_if_any(filmed: dict[str, StudyResults]) -> None:
    study = filmed["study"]

    def told(stated: float) -> dict[str, Fact]:
        sizes = {"pixel_size": 0.49, "pixel_size_stated": stated}
        compared = {name: data.assign(sizes) for name, data in study.compared.items()}
        made = kinds.kind_of(study.problem).facts(replace(study, compared=compared))
        return {fact.key: fact for fact in made}

    found = told(0.5)
    assert found["altered_1_pixel"].value == pytest.approx(0.98)
    assert found["altered_1_pixel"].ours == "0.9800"
    assert "0.4900 mm" in found["altered_1_pixel"].note
    assert "altered_1_scale" not in found
    assert "altered_1_pixel" not in told(np.nan)


def test_prediction_bands_are_told_of_with_their_own_level(
    filmed: dict[str, StudyResults],
) -> None:
    study = filmed["study"]
    level = study.problem.prediction.model_copy(update={"level": 0.8})
    asked = study.problem.model_copy(update={"prediction": level})
    compared = {name: data.assign(band_samples=64) for name, data in study.compared.items()}
    study = replace(study, problem=asked, compared=compared)
    figure = kinds.kind_of(asked).figure(study)
    assert "the bands hold 80 % of simulations" in figure.caption
    notes = {fact.key: fact.note for fact in kinds.kind_of(asked).facts(study)}
    assert "of which 80 % have" in notes["altered_1_coverage"]
    note = notes["measured_peak_to_peak_altered"]
    assert "95 %: " in note
    assert "; predicted, 80 %: " in note
