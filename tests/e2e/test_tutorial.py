"""The tutorial does as it says: its commands run, its YAML is valid, its Python prints."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from pipeline.environment import ROOT
from pipeline.problem import load, preset_names, void_units
from pipeline.problem.loading import overlaid
from tests.e2e.checkout import Checkout

BLOCK = re.compile(r"^```(.+?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_tutorial(tmp_path: Path) -> None:
    checkout = Checkout.made(tmp_path / "checkout")
    checkout.take_kernels(ROOT)
    blocks = BLOCK.findall((ROOT / "docs/tutorial.md").read_text(encoding="utf-8"))
    assert {kind for kind, _ in blocks} == {"sh", "sh full", "yaml", "python"}
    problem = checkout.root / "experiments/logo/problem.yaml"
    for kind, text in blocks:
        if kind == "sh":
            ended = checkout.shell(text)
            assert ended.returncode == 0, ended.stdout + ended.stderr
        elif kind == "yaml":
            asked = overlaid(yaml.safe_load(problem.read_text()), yaml.safe_load(text))
            changed = problem.with_name("changed.yaml")
            changed.write_text(yaml.safe_dump(asked))
            assert len(void_units(load(changed))) > 20
        elif kind == "python":
            ended = checkout.script(text)
            assert ended.returncode == 0, ended.stderr
            altered, cloaked = re.findall(r"error ([\d.]+) force", ended.stdout)
            assert float(cloaked) < 0.8 * float(altered)
        else:
            assert text == "make logo\n"
            assert load(problem).title == "Logo"
    assert preset_names(problem) == ("quick",)
    assert (checkout.root / "results/logo@quick/report/index.html").stat().st_size > 100_000
