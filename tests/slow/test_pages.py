"""The tutorials to the letter: the whole study, its specimens and its recordings."""

from pathlib import Path

from tests.docs.pages import WALKED
from tests.docs.walk import Reader


def test_the_tutorials(tmp_path: Path) -> None:
    root = tmp_path / "checkout"
    reader = Reader.in_folder(root, draft=False)
    said = {page: reader.told(page) for page in WALKED}
    for name in ("assembly.pdf", "bom.csv", "fixture", "laser", "manifest.json", "print"):
        assert name in said["docs/printer.md"].split()
    assert (root / "dots.pdf").read_bytes().startswith(b"%PDF")
    assert (root / "results/logo/report/index.html").is_file()
    assert (root / "results/logo/recordings/rehearsal/track.nc").is_file()
