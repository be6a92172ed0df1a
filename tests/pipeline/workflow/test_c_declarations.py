"""The headers declare to C what Python declares, and C defines all of it."""

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
