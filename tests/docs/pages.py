"""The documentation as its readers use it: blocks of commands, YAML, Python and messages."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass

from pipeline.runtime import ROOT

PAGES = ("README.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")))
PLACE = re.compile(r"^  file:.*\n", re.MULTILINE)
"""The line of a message that tells the file, whose lines are numbered anew by any edit."""
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"`([^`]+)`")
_TARGET = r"((?:make|(?:\.venv/bin/)?snakemake)(?: -n)? [a-z][\w@-]*)"
WALKED = ("docs/tutorial.md", "docs/video.md", "docs/printer.md", "docs/faq.md")
"""The pages whose commands are all run, in this order, in one checkout."""
_VARIABLE = re.compile(r"[A-Z]+=\S*")


@dataclass(frozen=True)
class Block:
    """A fenced block: its page, its language, and what it holds."""

    page: str
    language: str
    text: str

    @property
    def place(self) -> str:
        """The file of a block of YAML, as its first line tells."""
        return self.text.partition("\n")[0].removeprefix("# ")


@dataclass(frozen=True)
class Command:
    """A command and its words, without what a shell would do with them."""

    page: str
    text: str

    @property
    def words(self) -> list[str]:
        return shlex.split(self.text, comments=True)

    @property
    def targets(self) -> list[str]:
        """What make or Snakemake is asked for."""
        given = self.words[1:]
        return [
            each for each in given if not each.startswith("-") and not _VARIABLE.fullmatch(each)
        ]


def text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(*pages: str) -> list[Block]:
    """The blocks of some pages, in their order."""
    return [Block(page, *found) for page in pages for found in _BLOCK.findall(text(page))]


def commands() -> Iterator[Command]:
    """Every command on every page: those of the blocks, and targets within sentences."""
    for block in blocks(*PAGES):
        if block.language == "bash":
            for line in block.text.replace("\\\n", " ").splitlines():
                yield Command(block.page, line)
    for page in PAGES:
        for told in inline(_TARGET, page):
            yield Command(page, " ".join(told.split()))


def inline(pattern: str, *pages: str) -> list[str]:
    """What the pattern finds in code within sentences, of which the whole has to match."""
    told = [code for page in pages or PAGES for code in _CODE.findall(_BLOCK.sub("", text(page)))]
    return [found[1] for code in told if (found := re.fullmatch(pattern, code)) is not None]
