"""What a build leaves: readable logs, complete results, and nothing to be done."""

import resource

from tests.e2e.checkout import Checkout, assert_plain


def test_the_results_are_complete(undisturbed: Checkout) -> None:
    names = {"design_sqp.nc", "design_mma.nc", "design.nc", "response.nc", "sweep.nc"}
    report = {f"report/tiny.{suffix}" for suffix in ("pdf", "svg", "png")} | {"report/index.html"}
    assert names | report <= set(undisturbed.built())


def test_logs_are_plain_lines_that_tell_what_happened(undisturbed: Checkout) -> None:
    logs = {path.stem: path.read_text() for path in undisturbed.results.glob("logs/*.log")}
    for text in logs.values():
        assert_plain(text)
    assert "12/12" in logs["design_sqp"]
    assert "skipped: simulation of the unloaded reference" in logs["design_sqp"]
    assert "shipped: the design by" in logs["select"]


def test_a_second_run_is_quick_and_has_nothing_to_do(undisturbed: Checkout) -> None:
    def spent() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    before = spent()
    ended = undisturbed.snakemake()
    assert "Nothing to be done" in ended.stderr
    assert spent() - before < 5.0  # seconds of a core: the clock would count others' work
