"""Tells which joints a study simulates stiffer, or softer, than the shims that are drawn there."""

from collections.abc import Sequence

from pipeline.fabrication.parts import BuiltSpecimen

_NAMED, _SORTS = 24, 4  # joints of one stiffness, and stiffnesses; the bill names all


def factor_words(factors: Sequence[float]) -> str:
    """Tells how many times as stiff as its shim a ligament is in the study."""
    each = [f"{factor:.3g}" for factor in factors]
    if len(set(each)) == 1:
        return f"{each[0]} times as stiff"
    return "{} times as stiff along, {} across, {} in bending".format(*each)


def stiffness_words(specimen: BuiltSpecimen) -> str:
    """Tells which joints are to be how many times as stiff as their shims; empty if none."""
    joints: dict[str, list[str]] = {}
    for ligament in specimen.ligaments:
        if ligament.number in specimen.stiffness:
            words = factor_words(specimen.stiffness[ligament.number])
            joints.setdefault(words, []).append(ligament.name)
    if len(joints) > _SORTS:
        return f"{len(specimen.stiffness)} joints of {len(joints)} stiffnesses, in the bill"
    return "; ".join(f"{words}: {_named(names)}" for words, names in joints.items())


def _named(names: Sequence[str]) -> str:
    more = len(names) - _NAMED
    told = ", ".join(names[:_NAMED])
    return told if more <= 0 else f"{told} and {more} more (bill)"
