import json
import shutil
from pathlib import Path

import pytest
import requests
import rocrate

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.runtime import ROOT, UserError
from pipeline.workflow import publish
from pipeline.workflow.studies import Study
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
    publish.copy_sources(folder)
    shutil.copytree(built, folder / publish.BUILT)
    publish.describe(Study.parse("fig4@quick"), folder)
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
    origin = {each["@id"]: each.get("keywords") for each in graph}
    assert origin["published/track.nc"] == "synthetic"
    assert origin["published/population.nc"] == "measured"
    assert origin["published/response.nc"] == "simulated"
    assert "experiments/validation/escapement/LICENSE" in origin


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
