import re

import pytest

from pipeline.runtime import ROOT

TEMPLATES = sorted((ROOT / "reports/page/templates").glob("*.html.j2"))


@pytest.mark.parametrize("name", [path.name for path in TEMPLATES])
def test_drawings_have_words_and_headings_a_direction(name: str) -> None:
    """Lists what a reader of the page by ear is told of."""
    text = (ROOT / "reports/page/templates" / name).read_text(encoding="utf-8")
    for drawing in re.finditer(r"\{\{ svgs?(\[[^]]+\])? \| safe \}\}", text):
        assert re.search(r'role="img" aria-label="[^"]+">$', text[: drawing.start()])
    for heading in re.findall(r"<th\b[^>]*>", text):
        assert "scope=" in heading
