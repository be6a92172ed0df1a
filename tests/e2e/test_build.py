import resource
import shutil
from pathlib import Path

from reports.__main__ import main
from tests.e2e.checkout import Checkout, assert_plain
from tests.reports.page.test_report_page import Links


def test_the_results_are_complete(undisturbed: Checkout) -> None:
    names = {"design_sqp.nc", "design_mma.nc", "design.nc", "response.nc", "sweep.nc"}
    report = {f"report/tiny.{suffix}" for suffix in ("pdf", "svg", "png")} | {"report/index.html"}
    assert names | report <= set(undisturbed.built())


def test_every_link_leads_somewhere(undisturbed: Checkout, tmp_path: Path) -> None:
    results = shutil.copytree(undisturbed.root / "results", tmp_path / "results")
    assert main(["index", "--results", str(results), "--quiet"]) == 0
    links = {page: Links(page.read_text(encoding="utf-8")) for page in results.rglob("*.html")}
    assert len(links) == 2
    for page, found in links.items():
        for address in (*found.hrefs.values(), *found.loaded):
            file, _, place = address.partition("#")
            if not file.startswith(("data:", "https://")):
                assert not place or place in found.ids, (page, address)
                assert (page.parent / file).is_file() or not file, (page, address)


def test_logs_are_plain_lines_that_tell_what_happened(undisturbed: Checkout) -> None:
    logs = {path.stem: path.read_text() for path in undisturbed.results.glob("logs/*.log")}
    for text in logs.values():
        assert_plain(text)
    assert "12/12" in logs["design_sqp"]
    assert "skipped: simulation of the unloaded reference" in logs["design_sqp"]
    assert "shipped: the design by" in logs["select"]


def test_a_second_run_is_quick_and_has_nothing_to_do(undisturbed: Checkout) -> None:
    """Some three times as long as Snakemake takes to load: seconds would be those of a machine."""

    def spent(*words: str) -> tuple[float, str]:
        """Runs Snakemake; returns seconds of a core and its words."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        ended = undisturbed.snakemake(*words)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        return used, ended.stderr

    loading, _ = spent("--version")
    used, words = spent()
    assert "Nothing to be done" in words
    assert used < 6.0 * loading
