"""Builds the package: the rooms of this repository below one name, `metacloak`.

What imports `sim`, `pipeline` or `reports` here imports `metacloak.sim` and so on there, and what
runs `python -m pipeline` runs `python -m metacloak.pipeline`. All else is in pyproject.toml.
"""

import re
import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).resolve().parent
ROOMS = ("sim", "pipeline", "reports")
BESIDE = ("Snakefile", "CITATION.cff", "profiles")
_ROOM = rf"(?P<room>{'|'.join(ROOMS)})\b"
_IMPORTED = re.compile(rf"^(?P<before>\s*(?:from|import) ){_ROOM}", re.MULTILINE)
_RUN = re.compile(rf"(?P<before>python -m ){_ROOM}")
_TOLD = "python -m pipeline"


def installed(path: Path, text: str) -> str:
    """Rewrites imports and commands of a source file to those of the installed package."""
    text = _IMPORTED.sub(r"\g<before>metacloak.\g<room>", text)
    if path.suffix in (".py", ".toml", ".yaml"):
        text = text.replace(_TOLD, "metacloak")
    return _RUN.sub(r"\g<before>metacloak.\g<room>", text)


class BuildRooms(build_py):
    """Copies the rooms and what the workflow needs beside them into the package."""

    def run(self) -> None:
        """Copies all; a checkout that is installed in place needs none of it."""
        super().run()
        if self.editable_mode:
            return
        package = Path(self.build_lib) / "metacloak"
        for name in (*ROOMS, *BESIDE):
            shutil.rmtree(package / name, ignore_errors=True)
            place = ROOT / name
            for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
                if path.is_file() and "__pycache__" not in path.parts:
                    self._copy(path, package / path.relative_to(ROOT))

    @staticmethod
    def _copy(path: Path, copy: Path) -> None:
        copy.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix in (".py", ".pyi", ".smk", ".toml", ".yaml") or path.name == "Snakefile":
            copy.write_text(installed(path, path.read_text(encoding="utf-8")), encoding="utf-8")
        else:
            shutil.copy(path, copy)


MADE = ROOT / ".cache/package"
MADE.mkdir(parents=True, exist_ok=True)
setup(
    cmdclass={"build_py": BuildRooms},
    options={"build": {"build_base": str(MADE)}, "egg_info": {"egg_base": str(MADE)}},
)
