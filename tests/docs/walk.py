"""A reader who does all that the pages say, in their order, in one checkout."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

from pipeline.problem.reading import load, overlay_keys
from pipeline.runtime import ROOT
from pipeline.tracking.frames import recording
from pipeline.tracking.output import dic_points
from tests.docs.pages import Block, blocks, text
from tests.e2e.checkout import Checkout, Ended

LAID_OVER = "laid over "
_PLAN = ".venv/bin/snakemake --dry-run"


@dataclass(frozen=True)
class Reader:
    """Who reads, where, and whether the study `logo` is built as a draft in its place."""

    checkout: Checkout
    draft: bool

    @classmethod
    def in_folder(cls, root: Path, *, draft: bool) -> Reader:
        """A reader who has just got the repository."""
        checkout = Checkout.made(root)
        shutil.rmtree(root / "experiments/logo", ignore_errors=True)
        (root / "docs").mkdir()
        shutil.copy(ROOT / "docs/example_sim.py", root / "docs")
        (root / "films").mkdir()
        shutil.copy(ROOT / "tests/data/tracking/f_silhouette.mp4", root / "films/phone.mp4")
        return cls(checkout, draft)

    def told(self, page: str) -> str:
        """Does what a page says, of which all but what stands before an `error:` succeeds."""
        said = ""
        for block, ended in self._read(page):
            wrong = (ended.returncode != 0) != is_mistake(block)
            assert not wrong, block.text + ended.stdout + ended.stderr
            said += ended.stdout + ended.stderr
        return said

    def _read(self, page: str) -> Iterator[tuple[Block, Ended]]:
        for block in blocks(page):
            if block.language == "bash":
                yield block, self.checkout.shell(self._meant(block.text))
            elif block.language == "python":
                yield block, self.checkout.script(self._meant(block.text))
            elif block.language == "yaml" and not is_mistake(block):
                self._write(block)

    def _meant(self, words: str) -> str:
        """The text with the draft in the place of the study, and recordings planned only."""
        if not self.draft:
            return words
        meant = words.replace("results/logo/", "results/logo@quick/")
        meant = meant.replace("make logo_recordings", f"{_PLAN} logo@quick_recordings")
        return re.sub(r"^make logo$", "make logo@quick", meant, flags=re.MULTILINE)

    def _write(self, block: Block) -> None:
        """Writes a file that a page shows, or checks what it lays over one."""
        place = self.checkout.root / block.place.removeprefix(LAID_OVER)
        if block.place.startswith(LAID_OVER):
            checked(block, place)
        else:
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(block.text)


def is_mistake(block: Block) -> bool:
    """Whether a message that begins with `error:` follows."""
    return f"{block.text}```\n\n```text\nerror: " in text(block.page)


def checked(block: Block, problem: Path) -> None:
    """Checks a problem file with the keys of a block laid over it."""
    changed = problem.with_name("changed.yaml")
    asked = overlay_keys(yaml.safe_load(problem.read_text()), yaml.safe_load(block.text))
    changed.write_text(yaml.safe_dump(asked, sort_keys=False))
    try:
        load(changed)
    finally:
        changed.unlink()


def check_recording(block: Block, folder: Path) -> None:
    """Checks the YAML of a recording, or of points, that a page shows."""
    path = folder / block.place
    path.write_text(block.text)
    if "points" in yaml.safe_load(block.text):
        dic_points.load(path)
    else:
        recording.load_recording(path)
