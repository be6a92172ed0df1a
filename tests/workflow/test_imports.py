import importlib

from pipeline.runtime import ROOT

ELSEWHERE = ("benchmarks.tracking.pyvale_points",)
"""Runs in an environment of its own."""

MODULES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for room in ("sim", "pipeline", "reports", "benchmarks")
    for path in (ROOT / room).rglob("*.py")
    if path.name not in ("__init__.py", "__main__.py")
)


def test_every_module_can_be_imported() -> None:
    for module in set(MODULES) - set(ELSEWHERE):
        assert importlib.import_module(module).__name__ == module
