"""Reads the words of a written PDF, and checks that the assembly sheet names every part."""

from __future__ import annotations

import base64
import re
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path

from pipeline.fabrication.readback.faults import BUG, Fault
from pipeline.runtime import UserError

_STREAM = re.compile(rb"stream\r?\n(.*?)endstream", re.DOTALL)
_SHOWN = re.compile(rb"\(((?:[^()\\]|\\.)*)\)\s*Tj")
_ESCAPED = re.compile(r"\\(.)")


def words(path: Path) -> list[list[str]]:
    """The pieces of text on each page, in the order in which they are shown.

    Raises:
        UserError: it is no PDF, or has no text.
    """
    try:
        content = path.read_bytes()
        pages = [_texts(_unpacked(found)) for found in _STREAM.findall(content)]
    except (OSError, ValueError, zlib.error) as error:
        raise _unreadable(path, str(error)) from error
    if not content.startswith(b"%PDF") or b"%%EOF" not in content[-32:] or not any(pages):
        raise _unreadable(path, "it is not whole")
    return [page for page in pages if page]


def check(path: Path, ids: Collection[str]) -> Iterator[Fault]:
    """Faults of an assembly sheet that should name each of `ids` on its plan."""
    shown = {text for page in words(path) for text in page}
    for missing in sorted(set(ids) - shown):
        yield Fault(f"unit {missing}", "it is not on the assembly sheet", "labels", BUG, path)


def _unpacked(stream: bytes) -> bytes:
    """A page's operators; reportlab packs them with Flate and then in base 85."""
    stream = stream.strip()
    if stream.endswith(b"~>"):
        stream = base64.a85decode(stream.removesuffix(b"~>"))
    return zlib.decompress(stream)


def _texts(operators: bytes) -> list[str]:
    return [_ESCAPED.sub(r"\1", found.decode("cp1252")) for found in _SHOWN.findall(operators)]


def _unreadable(path: Path, why: str) -> UserError:
    return UserError(
        f"the assembly sheet that was just written cannot be read back: {why}",
        file=path,
        remedy=BUG,
    )
