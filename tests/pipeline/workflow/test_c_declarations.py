"""The headers declare to C what Python declares, and C defines all of it."""

import re
from collections.abc import Iterator
from pathlib import Path

from pipeline.runtime import ROOT
from pipeline.workflow.c_declarations import libraries
from sim.core.compiler import sources


def test_headers_are_of_the_declarations() -> None:
    for library in libraries():
        words = f"{library.header_file} is old: run `python -m pipeline declarations`"
        assert library.header == library.declarations(), words


def test_every_declared_function_can_be_bound() -> None:
    for library in libraries():
        assert len(library.functions) > 3
        for function in library.functions:
            assert callable(function.call)


def test_functions_are_defined_in_the_file_of_their_name() -> None:
    """Finds `symmetric_solve` in symmetric.c, as a newcomer would."""
    for library in libraries():
        texts = {path.stem: path.read_text() for path in sources(library.folder)}
        for function in library.functions:
            assert f"{function.symbol}(" in texts[function.module], function.symbol


def constants_of_c(path: Path) -> Iterator[tuple[str, float]]:
    """Reads the numbers that a file names: `enum { A = -1, B }`, `static const double C = 1e-3`."""
    text = re.sub(r"#ifdef.*?#else", "", path.read_text(), flags=re.DOTALL)
    for names in re.findall(r"enum \{([^}]*)\}", text):
        value = -1
        for name, given in re.findall(r"(\w+)(?: = ([^,]+\b))?", names):
            if given and not given.lstrip("-").isdigit():
                break  # computed, and so are those after it
            value = int(given) if given else value + 1
            yield name, value
    for line in re.findall(r"static const double ([^;]*);", text):
        numbers = re.findall(r"(\w+) = (-?[\d.]+(?:e-?\d+)?)(?:,|$)", line)
        yield from ((name, float(given)) for name, given in numbers)


def constants_of_python(path: Path) -> Iterator[tuple[str, float]]:
    """Reads the numbers that a module names: `A = -1`, `A, B = 0, 1`."""
    named = re.compile(r"^([A-Z_, ]+) = ([-\d.e, ]+)$", re.MULTILINE)
    for names, values in named.findall(path.read_text()):
        pairs = zip(names.split(", "), values.split(", "), strict=True)
        yield from ((name, float(value)) for name, value in pairs)


def test_constants_of_both_languages_have_one_value() -> None:
    """Compares x.c with x.py, and a header with the modules beside it."""
    both = set()
    for path in (path for room in ("sim", "pipeline") for path in sources(ROOT / room)):
        beside = path.parent.glob("*.py" if path.suffix == ".h" else f"{path.stem}.py")
        known = {name: value for module in beside for name, value in constants_of_python(module)}
        for name, value in constants_of_c(path):
            if name in known:
                assert value == known[name], f"{name} of {path}"
                both.add(name)
    assert {"NARROW", "BY_PANELS", "FAR", "FACTORS", "BRANCHING", "INDEFINITE", "SIZE"} <= both
