"""States facts: numbers of a report beside those that the paper quotes, and their origin."""

import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from difflib import get_close_matches
from pathlib import Path

from pipeline.problem.sections import Paper
from pipeline.runtime import UserError
from reports.base import Table, prose, typeset

ABSENT = "—"


@dataclass(frozen=True)
class Fact:
    """Describes one line of a table of facts.

    `value` is in `unit` ("1" if it has none, "%" for a share in hundredths); `ours` and `paper` are
    the same numbers in words, `paper` a dash where it quotes none.
    """

    key: str
    label: str
    value: float
    unit: str
    ours: str
    paper: str = ABSENT
    note: str = ""
    group: str = ""


def number(
    key: str,
    label: str,
    value: float,
    unit: str = "1",
    *,
    digits: int = 4,
    paper: str = ABSENT,
    note: str = "",
) -> Fact:
    """Returns fact whose wording is the value to `digits` significant digits and its unit."""
    return Fact(key, label, value, unit, worded(value, unit, digits), paper, note)


def share(key: str, label: str, value: float, paper: str = ABSENT, note: str = "") -> Fact:
    """Returns fact of a share given as a fraction of one, shown in per cent to a tenth."""
    return Fact(key, label, 100.0 * value, "%", percent(value), paper, note)


def facts_of(module: str) -> Callable[..., Fact]:
    """Returns what makes the facts told of in the YAML beside a module, given its `__file__`.

    By key, that has the label, and where they are not empty note, unit and the paper's words, with
    the digits of the value in words (4). The unit "share" is of a fraction of one. Names in braces
    are filled in; note, unit and paper may be given instead.
    """
    rows = prose(module)

    def made(key: str, value: float, ours: str = "", /, **words: object) -> Fact:
        row = {"unit": "1", "note": "", "paper": ABSENT, **rows[key]}
        label, unit, note, paper = (
            str(words[name]) if name in words else row[name].format_map(words)
            for name in ("label", "unit", "note", "paper")
        )
        key = key.format_map(words)
        if unit == "share":
            value, unit, ours = 100.0 * value, "%", ours or percent(value)
        ours = ours or worded(value, unit, row.get("digits", 4))
        return Fact(key, label, value, unit, ours, paper, note)

    return made


def quoted(facts: Sequence[Fact], paper: Paper | None) -> list[Fact]:
    """Returns the facts with the words that a publication uses for them; without one, with none.

    Raises:
        UserError: the publication's words are for a fact that there is not.
    """
    if paper is None:
        return [replace(fact, paper=ABSENT) for fact in facts]
    known = {fact.key for fact in facts}
    for key in paper.values:
        if key not in known:
            near = get_close_matches(key, known, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            remedy = f"{hint}the facts here: {', '.join(sorted(known))}"
            raise UserError("no such fact", key=f"report.paper.values.{key}", remedy=remedy)
    return [replace(fact, paper=paper.values.get(fact.key, fact.paper)) for fact in facts]


def grouped(group: str, facts: Iterable[Fact]) -> list[Fact]:
    """Returns the same facts under one heading."""
    return [replace(fact, group=group) for fact in facts]


def within(value: float, unit: str, digits: int) -> str:
    """Returns wording of an error (not negative): one too small to mean more is told as a bound."""
    return worded(value, unit, digits) if value >= 1e-9 else f"below {worded(1e-9, unit, 1)}"


def worded(value: float, unit: str, digits: int) -> str:
    """Returns number and unit as they are printed."""
    return printed(significant(value, unit, digits), unit)


def significant(value: float, unit: str, digits: int) -> str:
    """Writes a number of a unit without it; tiny rounding leftovers are zero.

    Energies grow with the square of a load, so that soft structures have true ones as small.
    """
    rounding = 1e-18 if unit == "N mm" else 1e-9
    return "0" if abs(value) < rounding else f"{value:.{digits}g}"


def printed(text: str, unit: str) -> str:
    """Sets a number that Python has written, with its unit: powers of ten, minus sign."""
    return typeset(text) + {"1": "", "deg": "°"}.get(unit, f" {unit}")


def percent(value: float) -> str:
    """Returns fraction of one as per cent to a tenth."""
    return f"{100 * value:.1f} %".replace("-0.0 ", "0.0 ").replace("-", "−")


def write_json(facts: Sequence[Fact], path: Path) -> None:
    """Writes facts as a list of objects, in the table's order; a value not finite is null."""
    records = [
        asdict(fact) | {"value": fact.value if math.isfinite(fact.value) else None}
        for fact in facts
    ]
    path.write_text(json.dumps(records, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")


def read_json(path: Path) -> list[Fact]:
    """Returns facts as they were written; a value that was not finite is NaN."""
    records = json.loads(path.read_text(encoding="utf-8"))
    return [
        Fact(**(record | {"value": math.nan if record["value"] is None else record["value"]}))
        for record in records
    ]


def table(facts: Sequence[Fact]) -> Table:
    """Returns facts as a table, one a line."""
    columns = {entry.name: [getattr(fact, entry.name) for fact in facts] for entry in fields(Fact)}
    return Table("facts.csv", "the numbers above", columns)
