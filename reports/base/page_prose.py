"""Reads the prose of a page from the YAML beside the module that makes it."""

from pathlib import Path
from typing import Any

import yaml


def prose(module: str) -> dict[str, Any]:
    """Reads the prose of a module, given its `__file__`."""
    return yaml.safe_load(Path(module).with_suffix(".yaml").read_text(encoding="utf-8"))
