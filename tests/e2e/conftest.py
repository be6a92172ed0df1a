import fcntl
import os
from pathlib import Path

import pytest

from tests.e2e.checkout import Checkout


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A checkout in which `make` built the study at one go, once for all; not to be changed."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:  # each has a folder of its own in the run's
        folder = folder.parent
    checkout, built = Checkout(folder / "undisturbed"), folder / "undisturbed_is_built"
    with (folder / "undisturbed.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not built.exists():
            Checkout.made(checkout.root)
            ended = checkout.make()
            assert ended.returncode == 0, ended.stdout + ended.stderr
            built.touch()
    return checkout


@pytest.fixture
def fresh(undisturbed: Checkout, tmp_path: Path) -> Checkout:
    """The same commit in another folder, with nothing built."""
    return undisturbed.copied(tmp_path / "grüße from a folder")
