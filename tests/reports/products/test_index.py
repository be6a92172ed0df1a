import base64
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.datasets import SYNTHETIC_LABEL, seal
from reports.__main__ import main
from reports.page import templating
from reports.products.index import index_report, inventory
from reports.study import StudyResults
from tests.reports.page.test_report_page import Links


@pytest.fixture(scope="module")
def results(study: StudyResults, report: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a figure with its datasets, and of a draft without."""
    folder = tmp_path_factory.mktemp("results")
    shutil.copytree(report, folder / "fig2/report")
    draft = folder / "fig2@quick/report/index.html"
    draft.parent.mkdir(parents=True)
    draft.write_text('<title>A draft</title><p class="draft">DRAFT</p>')
    for name, data in study.datasets.items():
        data.to_netcdf(folder / f"fig2/{name}.nc")
    (folder / "fig2/fabrication").mkdir()
    (folder / "fig2/fabrication/index.html").write_text("<p>what is built</p>")
    (folder / "benchmark").mkdir()
    (folder / "benchmark/fig2.csv").write_text("seconds\n1\n")
    (folder / "stress").mkdir()
    (folder / "stress/index.html").write_text("<p>nothing wrong</p>")
    return folder


@pytest.fixture(scope="module")
def html(results: Path) -> str:
    assert main(["index", "--results", str(results), "--quiet"]) == 0
    return (results / "index.html").read_text(encoding="utf-8")


def page(results: Path) -> str:
    return templating.rendered("index.html.j2", index_report.shown(results))


def test_it_works_from_disk_and_leads_to_what_is_there(html: str, results: Path) -> None:
    links = Links(html)
    assert all(address.startswith("data:") for address in links.loaded)
    for href in links.hrefs.values():
        assert href[1:] in links.ids if href.startswith("#") else (results / href).is_file(), href
    for data in inventory.reports(results)[0].datasets:
        assert f"sha256 {data.sha256}" in html
    assert page(results) == html
    wanted = {"fig2/report/index.html", "fig2/design.nc", "fig2/fabrication/index.html"}
    assert wanted | {"benchmark/fig2.csv", "stress/index.html"} <= set(links.hrefs.values())


def test_figures_come_first_drafts_are_marked_claims_judged(results: Path, html: str) -> None:
    names = [(built.name, built.figure, built.draft) for built in inventory.reports(results)]
    assert names == [("fig2", True, False), ("fig2@quick", False, True)]
    assert html.index("fig2/report/index.html") < html.index(">DRAFT<")
    assert "Figure 2: <a" in html
    assert "<code>make fig7</code> builds it" in html
    tables = {table["name"]: table for table in index_report.tables(())}
    assert all(each.simulation.why == "study not built" for each in tables["fig2"]["claims"])


@pytest.mark.parametrize("label", [SYNTHETIC_LABEL, ""])
def test_experiments_that_were_rendered_are_marked(label: str, results: Path) -> None:
    built = inventory.reports(results)[0]
    comparison = replace(built.datasets[0], synthetic=bool(label))
    shown = replace(built, datasets=[*built.datasets, comparison])
    assert shown.label == label
    values = index_report.shown(results)
    values |= {"figures": [(shown, "")], "tables": index_report.tables([shown])}
    html = templating.rendered("index.html.j2", values)
    mark = f" ({label})" if label else ""
    assert f'<th scope="col">Experiment{mark}</th>' in html
    assert f'data-label="Experiment{mark}"' in html
    assert f"in experiment{mark}, " in html
    assert ('<p class="tag">SYNTHETIC: what is called experiment' in html) is bool(label)
    assert (SYNTHETIC_LABEL in html) is bool(label)


@pytest.mark.parametrize("synthetic", ["yes", "no"])
def test_datasets_say_whether_they_were_rendered(
    synthetic: str, results: Path, study: StudyResults, tmp_path: Path
) -> None:
    made = Path(shutil.copytree(results, tmp_path / "results"))
    study.response.assign_attrs(synthetic=synthetic).to_netcdf(made / RESPONSE)
    assert inventory.reports(made)[0].label == (SYNTHETIC_LABEL if synthetic == "yes" else "")


def test_an_empty_folder_has_an_index_too(tmp_path: Path) -> None:
    assert "None has been built yet" in page(tmp_path)


def test_the_page_holds_small_movies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The smallest first; others play from the file beside the page."""
    (tmp_path / "movies").mkdir()
    for name, size in (("S1", 50), ("S2", 20), ("S3", 30)):
        (tmp_path / f"movies/{name}.mp4").write_bytes(name.encode() * (size // 2))
    monkeypatch.setattr(index_report, "LARGEST_MOVIES", 55)
    shown = page(tmp_path)
    for name in ("S2", "S3"):
        data = base64.b64encode((tmp_path / f"movies/{name}.mp4").read_bytes()).decode()
        assert f'src="data:video/mp4;base64,{data}"' in shown
    assert 'src="movies/S1.mp4"' in shown
    assert shown.count("Too large for this page") == 1
    assert page(tmp_path) == shown


def flipped(content: bytes) -> bytes:
    half = len(content) // 2
    return content[:half] + bytes([content[half] ^ 1]) + content[half + 1 :]


FACTS, PAGE, RESPONSE = "fig2/report/facts.json", "fig2/report/index.html", "fig2/response.nc"
Damage = Callable[[bytes], bytes]
DAMAGES: dict[str, tuple[str, Damage, str]] = {
    "edited": (FACTS, lambda old: old.replace(b'"value": ', b'"value": 1', 1), FACTS),
    "cut": (FACTS, lambda old: old[:100], FACTS),
    "flipped": (RESPONSE, flipped, RESPONSE),
    "foreign": (PAGE, lambda _: b"<title>Another study</title>", FACTS),
    "no text": (PAGE, lambda _: b"\xff\xfe\x00", PAGE),
}


@pytest.mark.parametrize(("damaged", "damage", "file"), DAMAGES.values(), ids=DAMAGES)
def test_damage_is_one_message_and_the_rest_is_built(
    damaged: str, damage: Damage, file: str, results: Path, tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    made = Path(shutil.copytree(results, tmp_path / "results"))
    seal.write_seal(made / RESPONSE)
    (made / damaged).write_bytes(damage((made / damaged).read_bytes()))
    assert main(["index", "--results", str(made)]) == 0
    told = capfd.readouterr().err
    assert told.count("left out: ") == 1
    assert f"file:   {made / file}" in told
    assert "Traceback" not in told
    page = (made / "index.html").read_text(encoding="utf-8")
    assert f"Left out: {file}: " in page
    assert "A draft" in page
