"""Reads figures.yaml: which kind of figure shows which studies, and in which movie they move."""

from collections.abc import Collection
from functools import cache
from pathlib import Path
from typing import NamedTuple

import yaml


class PaperFigure(NamedTuple):
    """Describes a figure of the paper: its kind, its studies, and their movie, if there is one."""

    kind: str
    studies: list[str]
    movie: str = ""


@cache
def paper_figures() -> dict[str, PaperFigure]:
    """Reads the figures, by name."""
    known = yaml.safe_load(Path(__file__).with_name("figures.yaml").read_text(encoding="utf-8"))
    return {name: PaperFigure(**figure) for name, figure in known.items()}


@cache
def paper_movies() -> dict[str, list[str]]:
    """Lists the studies that each movie shows, one after another."""
    movies: dict[str, list[str]] = {}
    for figure in paper_figures().values():
        if figure.movie:
            movies.setdefault(figure.movie, []).extend(figure.studies)
    return movies


def movies_of(studies: Collection[str]) -> list[str]:
    """Lists the movies that show any of these studies."""
    return [name for name, shown in paper_movies().items() if not set(shown).isdisjoint(studies)]
