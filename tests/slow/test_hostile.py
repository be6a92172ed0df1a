"""Killed runs and hostile places; `make survive` tries more kills, and makes a page of all."""

from collections.abc import Iterator

import pytest

from tests.e2e.checkout import Checkout
from tests.hostile import __main__ as hostile
from tests.hostile import kills, places


@pytest.fixture(scope="module")
def built() -> Iterator[tuple[Checkout, float]]:
    """A small study that is built, and how long that took, in s."""
    with hostile.built() as made:
        yield made


@pytest.mark.parametrize("attempt", places.ALL, ids=lambda attempt: attempt.__name__)
def test_a_hostile_place_spoils_nothing(
    built: tuple[Checkout, float], attempt: places.Attempt
) -> None:
    assert [str(tried) for tried in attempt(built[0]) if tried.fault] == []


def test_no_kill_at_random_changes_the_results(built: tuple[Checkout, float]) -> None:
    checkout, span = built
    other, made = checkout.copied(checkout.root.with_name("killed")), list[kills.Kill]()
    assert kills.killed(other, kills.built(checkout), 20, 0, span, made.append) == []
    assert len(made) == 20
