import argparse
import json
import shutil
import subprocess
from pathlib import Path
from urllib.parse import unquote

import pytest
import requests
import rocrate

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.problem import content_hash, outputs, section_hash
from pipeline.runtime import REPORTED, ROOT, UserError
from pipeline.workflow import publish
from pipeline.workflow.crates import BUILT, Publication, describe, leftovers, named_outside
from pipeline.workflow.recordings import shown_recordings
from pipeline.workflow.studies import Study, problem_of
from tests.pipeline.samples import sample

_CONTEXT = Path(rocrate.__file__).parent / "data/ro-crate.jsonld"


def _held(_self: object, url: str, **_: object) -> requests.Response:
    """Answers with the context that rocrate holds; its terms of Bioschemas were shorter in 1.1."""
    answer = requests.Response()
    answer.url, answer.status_code = url, 404
    if url.startswith("https://w3id.org/ro/crate/1.1/context"):
        text = _CONTEXT.read_text().replace("bioschemas.org/terms/", "bioschemas.org/")
        answer.status_code, answer._content = 200, text.encode()
        answer.headers["Content-Type"] = "application/ld+json"
    return answer


@pytest.fixture(scope="module")
def crate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The crate of a study of which only two datasets were made."""
    place = tmp_path_factory.mktemp("published")
    built = place / "built"
    for kind, synthetic in (("track", "yes"), ("population", "no"), ("response", None)):
        told = {"git_commit": provenance.git_commit()}
        told |= {} if synthetic is None else {"synthetic": synthetic}
        datasets.write(sample(kind), built / f"{kind}.nc", kind, told)  # type: ignore[arg-type]
    folder = place / "crate"
    asked = Publication.of("fig4@quick")
    publish.copy_sources(asked, folder)
    shutil.copytree(built, folder / BUILT / asked.target)
    describe(asked, folder)
    return folder


def test_it_holds_to_the_profile(crate: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from rocrate_validator import models, services
    from rocrate_validator.utils.http import HttpRequester

    for method in ("get", "head"):
        monkeypatch.setattr(HttpRequester, method, _held, raising=False)
    settings = services.ValidationSettings(
        rocrate_uri=str(crate), profile_identifier="workflow-run-crate", offline=True
    )
    settings.requirement_severity = models.Severity.REQUIRED
    found = services.validate(settings).get_issues()
    assert [each.message for each in found] == []
    graph = json.loads((crate / "ro-crate-metadata.json").read_text())["@graph"]
    origin = {unquote(each["@id"]): each.get("keywords") for each in graph}
    assert origin["published/fig4@quick/track.nc"] == "synthetic"
    assert origin["published/fig4@quick/population.nc"] == "measured"
    assert origin["published/fig4@quick/response.nc"] == "simulated"


def test_it_holds_the_files_of_no_other_study(crate: Path) -> None:
    held = {path.relative_to(crate / "experiments").as_posix() for path in crate.rglob("*.*")
            if path.is_relative_to(crate / "experiments")}  # fmt: skip
    assert held == {
        *("problem.schema.json", "fig4/problem.yaml", "fig4/recordings/altered.yaml"),
        *("fig4/recordings/cloaked.yaml", "validation/constants.csv", "validation/README.md"),
    }


@pytest.mark.parametrize(
    ("word", "folders"),
    [
        ("fig2_edge3", ["fig2@edge3"]),
        ("fig3@quick", ["fig3@quick", "fig3@quick.1", "fig3@quick.2"]),
        ("fig6", ["fig6", "fig6_heart", "fig6_shamrock"]),
    ],
)
def test_a_target_has_the_folders_of_all_that_it_builds(word: str, folders: list[str]) -> None:
    asked = Publication.of(word)
    assert asked.folders == folders
    assert all((ROOT / name).is_file() for name in asked.inputs)
    assert asked.about[0].endswith(f"({asked.target})")


def test_a_file_from_outside_the_experiments_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    study = Study("fig4")
    named = problem_of(study).report
    assert named.measured_constants
    moved = named.measured_constants.model_copy(update={"file": "../../docs/constants.csv"})
    report = named.model_copy(update={"measured_constants": moved})
    posed = problem_of(study).model_copy(update={"report": report})
    monkeypatch.setattr("pipeline.workflow.studies.problem_of", lambda _: posed)
    with pytest.raises(UserError, match="outside experiments") as told:
        named_outside(study)
    assert told.value.key == "report.measured_constants.file"
    assert told.value.value == "docs/constants.csv"


def test_what_is_not_of_the_problem_is_left_out_or_refused(tmp_path: Path) -> None:
    """A method was dropped, the sweep is no more; what the report shows has to be of today."""
    study = Study("fig6_heart", "quick")
    asked = problem_of(study)
    assert "sweep" not in outputs(asked)
    assert not shown_recordings(str(study))

    def write(name: str, kind: str, stage: str) -> None:
        told = {"git_commit": "", "problem_hash": section_hash(asked, stage)}
        datasets.write(sample(kind), tmp_path / f"{name}.nc", kind, told)  # type: ignore[arg-type]

    for name in outputs(asked):
        write(name, str(REPORTED[name].kind), REPORTED[name].name)
    assert leftovers(study, tmp_path) == []
    for left_over, kind in (("design_mma", "design_method"), ("sweep", "sweep")):
        write(left_over, kind, "fabricate")
    write("response_partial", "response", "simulate")
    (tmp_path / "sweep").mkdir()
    left = [path.name for path in leftovers(study, tmp_path)]
    assert left == ["design_mma.nc", "response_partial.nc", "sweep.nc", "sweep"]
    write("response", "response", "fabricate")
    with pytest.raises(UserError, match="another problem than the study's") as told:
        leftovers(study, tmp_path)
    assert told.value.key == "problem_hash"


def test_a_page_of_another_problem_is_refused(tmp_path: Path) -> None:
    asked, page = Publication.of("fig3@quick"), tmp_path / "index.html"
    hashes = [content_hash(problem_of(study)) for study in asked.studies]
    page.write_text(" ".join(hashes))
    publish.check_page(asked, page)
    page.write_text(hashes[0])
    with pytest.raises(UserError, match="shows another problem"):
        publish.check_page(asked, page)


def test_sources_that_are_not_as_committed_are_refused(tmp_path: Path) -> None:
    for name in ("sim/a.py", "experiments/mine/problem.yaml"):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).touch()
    with pytest.raises(UserError, match="no commit of these sources"):
        publish.check_sources(tmp_path)
    words = ["git", "-C", str(tmp_path), "-c", "user.name=T", "-c", "user.email=t@localhost"]
    subprocess.run([*words, "init", "--quiet"], check=True)
    subprocess.run([*words, "add", "sim"], check=True)
    subprocess.run([*words, "commit", "--quiet", "--message", "One"], check=True)
    publish.check_sources(tmp_path)
    (tmp_path / "sim/a.py").write_text("changed")
    with pytest.raises(UserError, match="not as committed") as told:
        publish.check_sources(tmp_path)
    assert told.value.file == str(tmp_path / "sim/a.py")
    (tmp_path / ".git/index").write_text("damaged")
    with pytest.raises(UserError, match=r"git does not tell .*index"):
        publish.check_sources(tmp_path)


def test_the_sources_of_a_crate_are_not_published_again(tmp_path: Path) -> None:
    words = ["git", "-C", str(tmp_path), "-c", "user.name=T", "-c", "user.email=t@localhost"]
    subprocess.run([*words, "init", "--quiet"], check=True)
    subprocess.run([*words, "commit", "--quiet", "--allow-empty", "--message", "One"], check=True)
    (tmp_path / provenance.COMMIT_FILE).write_text("of the sources before they were changed\n")
    with pytest.raises(UserError, match="no commit of these sources"):
        publish.check_sources(tmp_path)


def test_sources_and_place_are_checked_before_a_build(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(publish, "check_sources", lambda: None)
    asked = argparse.Namespace(target="fig4@quick", out_dir=tmp_path / "crate", check=True)
    publish.work(asked)  # of which nothing is built
    assert not asked.out_dir.exists()
    asked.out_dir.mkdir()
    with pytest.raises(UserError, match="there already"):
        publish.work(asked)


def test_its_sources_name_the_commit(crate: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    commit = provenance.git_commit()
    monkeypatch.setattr(provenance, "ROOT", crate)
    provenance.git_commit.cache_clear()
    assert provenance.git_commit() == commit
    monkeypatch.undo()
    provenance.git_commit.cache_clear()
    assert (crate / "requirements.lock").read_bytes() == (ROOT / "requirements.lock").read_bytes()


def test_data_of_other_sources_are_refused(tmp_path: Path) -> None:
    datasets.write(sample("response"), tmp_path / "response.nc", "response", {"git_commit": "old"})
    with pytest.raises(UserError, match="made by other sources"):
        publish.check_commits(tmp_path)
