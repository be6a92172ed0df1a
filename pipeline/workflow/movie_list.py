"""Lists the movies of the paper, with the studies that each shows one after another."""

from __future__ import annotations

from collections.abc import Collection

MOVIES: dict[str, tuple[str, ...]] = {
    "S1": ("fig2",),
    "S2": ("fig4",),
    "S3": ("fig5", "fig6_heart", "fig6_shamrock"),
    "S4": ("fig7",),
}


def showing(studies: Collection[str]) -> list[str]:
    """Lists the movies that show any of these studies."""
    return [name for name, shown in MOVIES.items() if not set(shown).isdisjoint(studies)]
