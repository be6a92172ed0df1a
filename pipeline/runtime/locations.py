"""Holds the folders of this project: its code, the work at hand, its caches.

In a checkout all three are there. Of an installed package the code lies in site-packages, the work
is the folder in which a command runs, and the caches are the user's.
"""

import tomllib
from importlib import metadata
from pathlib import Path

import platformdirs

ROOT = Path(__file__).resolve().parents[2]
"""Folder of the code: `sim`, `pipeline`, `reports` and the Snakefile."""

PREFIX = __name__.removesuffix("pipeline.runtime.locations")
"""Begins the names of modules: "metacloak." in an installed package, nothing in a checkout."""

INSTALLED = bool(PREFIX)

WORK = Path.cwd() if INSTALLED else ROOT
"""Folder of the studies (experiments/) and results."""

CACHE = platformdirs.user_cache_path("metacloak") if INSTALLED else ROOT / ".cache"

BUILD = "metacloak run" if INSTALLED else "make"
"""Begins the command that builds a target."""


def version() -> str:
    """Reads the version of the package, from its metadata or from the checkout."""
    if INSTALLED:
        return metadata.version("metacloak")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return str(project["version"])
