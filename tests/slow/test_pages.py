"""The tutorials to the letter: the whole study, its specimens and its recordings."""

from __future__ import annotations

import shutil
from pathlib import Path

from pipeline.environment import ROOT
from tests.docs.pages import WALKED
from tests.docs.walk import Reader
from tests.e2e.checkout import Checkout


def test_the_tutorials(tmp_path: Path) -> None:
    checkout = Checkout.made(tmp_path / "checkout")
    shutil.rmtree(checkout.root / "experiments/logo", ignore_errors=True)
    checkout.take_kernels(ROOT)
    reader = Reader(checkout, draft=False)
    said = {page: reader.told(page) for page in WALKED}
    for name in ("assembly.pdf", "bom.csv", "fixture", "laser", "manifest.json", "print"):
        assert name in said["docs/printer.md"].split()
    assert (checkout.root / "dots.pdf").read_bytes().startswith(b"%PDF")
    assert (checkout.root / "results/logo/report/index.html").is_file()
    assert (checkout.root / "results/logo/recordings/rehearsal/track.nc").is_file()
