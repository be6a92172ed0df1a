"""Poses the presets and designs of a problem file, to find their faults before a run does."""

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pipeline import problem
from pipeline.posing.robust_scene import design_scene, load_family
from pipeline.runtime import UserError

_NAMED = 3
"""Variants with the same fault that are named."""


def variant_faults(source: Path, variants: Sequence[str]) -> dict[str, UserError]:
    """Finds the faults of variants of a problem, each once, by the first variant that has it.

    Nothing is solved. The faults of the first variant are told as they are, those of others alone
    with the names of these.

    Args:
        source: the problem file.
        variants: presets, designs, or designs of presets: "quick", "2", "quick.2"; "" for the
            problem itself.
    """
    found: dict[str, tuple[UserError, list[str]]] = {}
    with _without_warnings():
        for variant in variants:
            if (fault := _fault(source, variant)) is not None:
                found.setdefault(str(fault), (fault, []))[1].append(variant)
    for fault, sharing in found.values():
        if sharing[0] != variants[0]:
            fault.what = f"{_listed(source.parent.name, sharing)}: {fault.what}"
    return {sharing[0]: fault for fault, sharing in found.values()}


def _fault(source: Path, variant: str) -> UserError | None:
    try:
        asked = problem.load(source, variant or None)
        design_scene(asked, source.parent)
        load_family(asked, source.parent)
        problem.check_measured_constants(asked, source.parent)
    except UserError as error:
        error.file = error.file or str(source)
        return error
    return None


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Silences warnings of scenes: they do not say which variant they are about."""
    logging.disable(logging.WARNING)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)


def _listed(study: str, variants: Sequence[str]) -> str:
    named = ", ".join(f"{study}@{each}" for each in variants[:_NAMED])
    others = len(variants) - _NAMED
    return f"{named} and {others} more" if others > 0 else named
