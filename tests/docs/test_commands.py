"""No page tells a command that there is not: every one is run, or planned as far as it can be.

Pages that are walked through (tests/slow/test_pages.py) have all commands run. Of every other page,
targets are planned by make and by Snakemake, and the options of stages are read by their parsers.
"""

import argparse
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from itertools import cycle, repeat
from typing import Any

import pytest

from pipeline.__main__ import main, run_stage
from pipeline.runtime import ROOT, STAGES
from pipeline.workflow.product_checks import check_products
from pipeline.workflow.studies import PRODUCTS, _reserved, targets
from tests.docs.pages import PAGES, WALKED, Command, blocks, commands, inline, text
from tests.e2e.checkout import Checkout

COMMANDS = list(commands())
MISTAKES = {"rigid_inclusion@quik": "docs/faq.md"}
"""Targets that there are not, and the pages that show what is told then."""


def is_run(command: Command) -> bool:
    return command.words[:4] == [".venv/bin/python", "-m", "pipeline", "run"]


def is_stage(command: Command) -> bool:
    return command.words[:2] == [".venv/bin/python", "-m"] and not is_run(command)


def of(*programs: str) -> list[Command]:
    return [each for each in COMMANDS if each.words[0] in programs]


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """The repository with the study that the tutorials make, and a recording of it."""
    made = Checkout.made(tmp_path_factory.mktemp("docs") / "checkout")
    shutil.rmtree(made.root / "experiments/logo", ignore_errors=True)
    assert run_stage("new", ["logo", "--folder", str(made.root / "experiments"), "--quiet"]) == 0
    recording = made.root / "experiments/logo/recordings/run1.yaml"
    recording.parent.mkdir()
    recording.write_text("structure: cloaked\nvirtual: {}\n", encoding="utf-8")
    return made


@pytest.mark.parametrize(
    "given", sorted({tuple(each.words[1:]) for each in of("make")}), ids=" ".join
)
def test_make_knows_its_targets(given: tuple[str, ...], checkout: Checkout) -> None:
    words = ["make", "--dry-run", *given]
    subprocess.run(words, cwd=checkout.root, capture_output=True, check=True)


def test_targets_are_studies_products_rules_or_commands_of_make() -> None:
    """Holds pages to presets and products, as make takes every preset of a study."""
    built = [*targets(), "logo", "logo@quick"]
    known = {f"{name}{end}" for name in built for end in ("", *PRODUCTS)} | set(_reserved())
    asked = {
        target: command.page
        for command in COMMANDS
        if command.words[0].endswith(("make", "snakemake")) or is_run(command)
        for target in command.targets[2 * is_run(command) :]
        if not (ROOT / target).is_dir()
    }
    assert {target: page for target, page in asked.items() if target not in known} == MISTAKES
    assert {"fig2@edge3", "fig2_front", "fig4@allow", "logo_recordings", "bench"} <= set(asked)
    check_products(asked)


@pytest.mark.slow
def test_snakemake_plans_its_targets(checkout: Checkout) -> None:
    known = set(checkout.snakemake("--list-target-rules").stdout.split())
    asked = {
        target
        for command in COMMANDS
        if command.words[0].endswith(("make", "snakemake")) or is_run(command)
        for target in command.targets
    }
    built = (asked & known) - {"clean"}
    planned = checkout.snakemake("--dry-run", *sorted(built))
    assert planned.returncode == 0, planned.stderr
    assert len(built) > 12
    for command in of(".venv/bin/snakemake", "snakemake"):
        assert set(command.targets) <= known


class ReadError(Exception):
    """The parser has read its options: enough."""


@pytest.mark.parametrize(
    "command", [each for each in COMMANDS if is_stage(each)], ids=lambda each: each.text[17:70]
)
def test_stages_know_their_options(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    read: Callable[..., Any] = argparse.ArgumentParser.parse_args

    def only_read(parser: argparse.ArgumentParser, *given: Any) -> None:  # noqa: ANN401
        read(parser, *given)
        raise ReadError

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", only_read)
    module, *options = command.words[2:]
    if module == "pytest":  # its tests are not for here
        assert all((ROOT / word).is_file() for word in options if not word.startswith("-"))
        return
    monkeypatch.setattr(sys, "argv", [module, *options])
    run: Callable[[], object] = partial(main, options)
    if module != "pipeline":
        monkeypatch.delitem(sys.modules, module, raising=False)
        run = partial(runpy.run_module, module, run_name="__main__", alter_sys=True)
    with pytest.raises((ReadError, SystemExit)) as ended:
        run()
    assert getattr(ended.value, "code", 0) == 0


def test_all_else_is_run_on_a_page_that_is_walked_through() -> None:
    assert len(COMMANDS) > 40
    assert {"README.md", "docs/tutorial.md", "docs/install.md"} <= {each.page for each in COMMANDS}
    found = {block.language for block in blocks(*PAGES)}
    assert found == {"bash", "python", "yaml", "text", "bibtex", ""}
    known = ("make", ".venv/bin/snakemake", "snakemake")
    for command in COMMANDS:
        if not (is_stage(command) or is_run(command) or command.words[0] in known):
            assert command.page in WALKED, command


def test_commands_and_files_in_a_sentence_are_there() -> None:
    for command in set(inline(r"python -m ([\w.]+(?: \w+)?)")):
        module, _, stage = command.partition(" ")
        path = ROOT.joinpath(*module.split("."))
        assert path.with_suffix(".py").is_file() or (path / "__main__.py").is_file()
        assert module != "pipeline" or not stage or stage in STAGES
    for name in set(inline(r"((?:sim|pipeline|reports|tests|experiments|docs)/[a-z_/.]+)")):
        assert (ROOT / name).exists() or "logo" in name, name


def test_what_jobs_ask_for_on_a_cluster_is_what_their_rules_say() -> None:
    rules = "".join(path.read_text() for path in (ROOT / "pipeline/rules").glob("*.smk"))
    bodies = dict(re.findall(r"^rule (\w+):\n((?:    .*\n|\n)*)", rules, re.MULTILINE))
    asked = {
        name: (int(found[1]) // 1000, int(found[2]))
        for name, body in bodies.items()
        if (found := re.search(r"mem_mb=(\d+),\n\s*runtime=(\d+),", body))
    }
    page = text("docs/cluster.md")
    told: dict[str, tuple[int, int]] = {}
    for names, memory, times in re.findall(
        r"^\| (`.*?) \| (\d+) GB \| (.*?) \|", page, re.MULTILINE
    ):
        rows = names.replace("`", "").split(", ")
        hours = [60 * int(each.removesuffix(" h")) for each in times.split(", ")]
        told |= zip(rows, zip(repeat(int(memory)), cycle(hours), strict=False), strict=False)
    assert told == asked
    gathered = re.search(r"What only joins files \((.*?)\)", page)
    two = re.search(r"on one core \((.*?) on two\)", page)
    assert gathered
    assert two
    local = {name for name, body in bodies.items() if "localrule: True" in body}
    assert set(re.findall(r"`(\w+)`", gathered[1])) == local - {"clean"}
    threaded = {name for name, body in bodies.items() if "threads: 2" in body}
    assert set(re.findall(r"`(\w+)`", two[1])) == threaded


def test_presets_of_several_studies_are_all_built() -> None:
    words = ["make", "--dry-run", "fig2@quick", "fig4@quick", "fig2"]
    told = subprocess.check_output(words, cwd=ROOT, text=True)
    assert told.count("-m pipeline run") == 3
