"""Runs examples and saves their pictures: all, with the page that shows them, or those named."""

import ast
import runpy
import sys
from pathlib import Path

import matplotlib
from matplotlib import pyplot as plt

HERE = Path(__file__).resolve().parent
SHARED = ("render", "specimen")
HEAD = """# Examples

One capability a script, at most 60 lines, run as tests with pinned numbers. From the folder of the
repository, `.venv/bin/python docs/examples/render.py modes` runs the one of that name and draws its
picture; without a name it draws all, and writes this page. Where `metacloak` is installed as a
package, `from metacloak import sim` takes the place of `import sim`.
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
    """Runs examples, saves their figures, and writes the page if none was named."""
    matplotlib.use("agg")
    sys.path[:0] = [str(HERE), str(HERE.parents[1])]
    for name in sys.argv[1:] or names():
        figure = runpy.run_path(str(HERE / f"{name}.py"))["figure"]
        figure.savefig(HERE / f"{name}.png", dpi=90, metadata={"Software": None})
        plt.close(figure)
        print(name)
    if sys.argv[1:]:
        return
    page = HEAD + "".join(section(name) for name in names())
    (HERE.parent / "examples.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
