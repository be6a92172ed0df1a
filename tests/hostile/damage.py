"""What may befall a file: bits turn, ends are lost, other files take its place, people edit it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from random import Random

Damage = Callable[[bytes, Random], bytes]

WORDS = (
    *("null", "[]", "{}", "[1, 2]", "{a: b}", "true", "-1", "0", "1e308", "1e400", ".nan", ".inf"),
    *("999999999999", "1000000", "''", '"\\0"', '"\\ud800"', "*alias", "&anchor 1", "2001-99-99"),
    *("0001-01-01T00:00:00+23:59", "15 parsec", "15", "1e300 mm", "-5 mm", "nan mm", "inf s"),
    *(
        "../../../../etc/passwd",
        "/dev/zero",
        "/",
        "x" * 5000,
        "ü 漢字",
        "1_000",
        "0x1F",
        "12:30:45",
    ),
    *('"$(touch pwned)"', "'; touch pwned'", "!!python/object/apply:os.system ['touch pwned']"),
    *(
        "!!timestamp x",
        "!!int ''",
        "!!bool x",
        "!!binary x",
        "!!set {a, b}",
        "{<<: 1}",
        "<<: {a: 1}",
    ),
    *("[[[[[[1]]]]]]", "[" * 4000, "? [a, b]", "|", ">", "%", "@", "`", "- - - 1", '"\\x1b[2J"'),
)
"""Values that some key of a YAML file, or some cell of a CSV, may be given by mistake or malice."""


def turned_bit(content: bytes, random: Random) -> bytes:
    """One bit is another."""
    out = bytearray(content)
    out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def turned_bits(content: bytes, random: Random) -> bytes:
    """So are twenty."""
    for _ in range(20):
        content = turned_bit(content, random)
    return content


def cut_short(content: bytes, random: Random) -> bytes:
    """The end is lost."""
    return content[: random.randrange(len(content))]


def emptied(content: bytes, random: Random) -> bytes:
    """All is lost but the name."""
    del content, random
    return b""


def zeroed(content: bytes, random: Random) -> bytes:
    """A part is zero, as where a block was never written."""
    start, end = _part(content, random)
    return content[:start] + bytes(end - start) + content[end:]


def scrambled(content: bytes, random: Random) -> bytes:
    """A part is noise."""
    start, end = _part(content, random)
    return content[:start] + random.randbytes(end - start) + content[end:]


def lacking(content: bytes, random: Random) -> bytes:
    """A part is not there."""
    start, end = _part(content, random)
    return content[:start] + content[end:]


def doubled(content: bytes, random: Random) -> bytes:
    """A part is there twice."""
    start, end = _part(content, random)
    return content[:end] + content[start:]


def lengthened(content: bytes, random: Random) -> bytes:
    """There is more behind the end."""
    return content + random.randbytes(random.randint(1, 4000))


def _part(content: bytes, random: Random) -> tuple[int, int]:
    start = random.randrange(len(content))
    return start, min(len(content), start + random.randint(1, 4096))


def other_value(content: bytes, random: Random) -> bytes:
    """A key of a YAML file has a value of another kind."""
    lines = content.decode().splitlines()
    keyed = [k for k, line in enumerate(lines) if re.match(r"[\s-]*\w+:", line)]
    at = random.choice(keyed)
    head = lines[at].partition(":")[0]
    lines[at] = f"{head}: {random.choice(WORDS)}"
    return "\n".join(lines).encode()


def other_key(content: bytes, random: Random) -> bytes:
    """A key of a YAML file has another name."""
    lines = content.decode().splitlines()
    keyed = [k for k, line in enumerate(lines) if re.match(r"[\s-]*\w+:", line)]
    at = random.choice(keyed)
    word = random.choice(("~", "1", "on", "2001-01-01", "'a b'", "? [a]", "<<", "ü", "''", "1.5"))
    lines[at] = re.sub(r"\w+:", lambda _: f"{word}:", lines[at], count=1)
    return "\n".join(lines).encode()


def other_line(content: bytes, random: Random) -> bytes:
    """A line is lost, there twice, or moved in or out."""
    lines = content.decode().splitlines()
    at = random.randrange(len(lines))
    changed = random.choice(([], [lines[at]] * 2, [f"  {lines[at]}"], [lines[at].lstrip()]))
    return "\n".join([*lines[:at], *changed, *lines[at + 1 :]]).encode()


def other_cell(content: bytes, random: Random) -> bytes:
    """A cell of a CSV holds something else."""
    lines = content.decode().splitlines()
    at = random.randrange(len(lines))
    cells = re.split(r"([,;])", lines[at])
    cells[2 * random.randrange((len(cells) + 1) // 2)] = random.choice(
        (*WORDS, "", '"', "nan", "\x00")
    )
    lines[at] = "".join(cells)
    return "\n".join(lines).encode()


ANY: Sequence[Damage] = (
    *(turned_bit, turned_bit, turned_bits, cut_short, cut_short, emptied, zeroed, scrambled),
    *(lacking, doubled, lengthened),
)
YAML: Sequence[Damage] = (other_value, other_value, other_key, other_line)
CSV: Sequence[Damage] = (other_cell, other_line)
