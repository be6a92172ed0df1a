"""The examples that optimise give the numbers that are pinned."""

import pytest

from tests.docs.test_gallery import OPTIMISING, check_numbers


@pytest.mark.parametrize("name", OPTIMISING)
def test_an_example_that_optimises_gives_its_numbers(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_numbers(name, monkeypatch)
