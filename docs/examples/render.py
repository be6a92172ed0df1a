"""Renders the pictures of all examples and the page that shows them."""

import ast
import runpy
import sys
from pathlib import Path

import matplotlib

HERE = Path(__file__).resolve().parent
SHARED = ("render", "specimen")
HEAD = """# Examples

One capability a script, at most 60 lines; `python docs/examples/NAME.py` runs one. All are run as
tests, with pinned numbers. Pictures and this page are made by `python docs/examples/render.py`.
"""


def names() -> list[str]:
    """Lists the examples."""
    return sorted(path.stem for path in HERE.glob("*.py") if path.stem not in SHARED)


def section(name: str) -> str:
    """Writes an example's part of the page: title, picture, code."""
    code = (HERE / f"{name}.py").read_text(encoding="utf-8")
    said = ast.get_docstring(ast.parse(code)) or name
    title, _, text = said.partition(": ")
    return (
        f"\n## {title}\n\n{text[0].upper()}{text[1:]}\n\n![{title}](examples/{name}.png)\n\n"
        f'```python title="docs/examples/{name}.py"\n{code.partition(chr(10))[2].lstrip()}```\n'
    )


def main() -> None:
    """Runs every example, saves its figure, and writes the page."""
    matplotlib.use("agg")
    sys.path[:0] = [str(HERE), str(HERE.parents[1])]
    for name in names():
        figure = runpy.run_path(str(HERE / f"{name}.py"))["figure"]
        figure.savefig(HERE / f"{name}.png", dpi=90, metadata={"Software": None})
        print(name)
    page = HEAD + "".join(section(name) for name in names())
    (HERE.parent / "examples.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
