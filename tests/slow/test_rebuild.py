"""Builds of `fig2@quick` that take minutes: from nothing in two folders."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.e2e.checkout import Checkout

TARGET = "fig2@quick"


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A checkout in which everything was compiled and built from nothing."""
    made = Checkout.made(tmp_path_factory.mktemp("first") / "checkout")
    return build(replace(made, own_caches=True))


def build(checkout: Checkout) -> Checkout:
    ended = checkout.make(TARGET)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return checkout


def test_builds_from_nothing_have_the_same_bytes(first: Checkout, tmp_path: Path) -> None:
    second = build(first.copied(tmp_path / "a deeper folder/größer"))
    assert second.built(TARGET) == first.built(TARGET)


def test_compiled_just_now_or_long_ago_the_bytes_are_the_same(
    first: Checkout, tmp_path: Path
) -> None:
    second = first.copied(tmp_path / "checkout")
    assert build(second).built(TARGET) == first.built(TARGET)
