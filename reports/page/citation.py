"""Tells how to cite this software, in words and as BibTeX, from CITATION.cff."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import yaml

FILE = Path(__file__).resolve().parents[2] / "CITATION.cff"


@cache
def citations() -> tuple[tuple[str, str, str], ...]:
    """Lists the paper, the software and the paper's data: each in words, and as BibTeX."""
    known = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    paper = known["preferred-citation"]
    works = [("The paper", paper), ("This software", known)]
    works += [("The paper's data", data) for data in known.get("references", ())]
    return tuple((what, _words(work), _bibtex(work)) for what, work in works)


def _words(work: Mapping[str, Any]) -> str:
    names = [_name(author, initials=True) for author in work["authors"]]
    version = f", version {work['version']}" if "version" in work else ""
    where = [str(work[key]) for key in ("journal", "year") if key in work]
    parts = [", ".join(names), f"{work['title']}{version}", *where, *_identifiers(work)]
    return ". ".join(parts) + "."


def _identifiers(work: Mapping[str, Any]) -> list[str]:
    others = [each["value"] for each in work.get("identifiers", ())]
    return [*([f"doi:{work['doi']}"] if "doi" in work else []), *others]


def _name(author: Mapping[str, str], *, initials: bool) -> str:
    if "name" in author:
        return author["name"] if initials else f"{{{author['name']}}}"
    given = author["given-names"]
    if not initials:
        return f"{author['family-names']}, {given}"
    letters = ("-".join(part[0] for part in word.split("-")) for word in given.split())
    return f"{author['family-names']} {' '.join(letters)}"


def _bibtex(work: Mapping[str, Any]) -> str:
    article = work.get("type") == "article"
    first = work["authors"][0]
    key = f"{first.get('family-names', work['title']).lower()}{work.get('year', work.get('type'))}"
    fields = {
        "author": " and ".join(_name(author, initials=False) for author in work["authors"]),
        "title": f"{{{work['title']}}}",
        **{name: str(work[name]) for name in ("journal", "year", "version", "doi") if name in work},
    }
    if others := work.get("identifiers"):
        fields["note"] = ", ".join(each["value"] for each in others)
    lines = [f"  {name} = {{{value}}}," for name, value in fields.items()]
    return "\n".join([f"@{'article' if article else 'misc'}{{{key},", *lines, "}"])
