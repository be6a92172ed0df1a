from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.environment import ROOT
from tests.e2e.checkout import Checkout


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A checkout in which `make` built the study at one go; not to be changed."""
    checkout = Checkout.made(tmp_path_factory.mktemp("undisturbed") / "checkout")
    checkout.take_kernels(ROOT)
    ended = checkout.make()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return checkout


@pytest.fixture
def fresh(undisturbed: Checkout, tmp_path: Path) -> Checkout:
    """The same commit in another folder, with nothing built."""
    checkout = undisturbed.copied(tmp_path / "grüße from a folder")
    checkout.take_kernels(undisturbed.root)
    return checkout
