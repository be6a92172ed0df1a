"""The benchmarks there are: one for each file of ``benchmarks/suites``."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence

from benchmarks import suites
from benchmarks.harness import Benchmark


def names() -> list[str]:
    """Names of all benchmarks."""
    return sorted(module.name for module in pkgutil.iter_modules(suites.__path__))


def load(wanted: Sequence[str]) -> list[Benchmark]:
    """The benchmarks asked for; without names the short ones.

    Raises:
        ValueError: there is no benchmark of that name.
    """
    unknown = sorted(set(wanted) - set(names()))
    if unknown:
        raise ValueError(f"no benchmark {unknown[0]!r}; there are: {', '.join(names())}")
    found = [_load(name) for name in wanted or names()]
    return found if wanted else [benchmark for benchmark in found if benchmark.short]


def _load(name: str) -> Benchmark:
    made = importlib.import_module(f"{suites.__name__}.{name}").benchmark()
    if not isinstance(made, Benchmark):
        raise TypeError(f"{suites.__name__}.{name}.benchmark() must return a Benchmark")
    return made
