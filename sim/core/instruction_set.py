"""Pins the instructions that compiled code may use, so that a design is the same on every machine.

A wider vector adds in another order: the last bit of a gradient changes, and where an optimiser
chooses between two optima, so may the design. All that computes is held to one level of x86-64:
AVX2 with fused multiply-add, which processors have had since 2013 (Intel) and 2015 (AMD). Others
compute with what they have.
"""

from functools import cache
from pathlib import Path

LEVEL = "x86-64-v3"

LIBRARIES = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
}
"""Environment variables that hold NumPy and OpenBLAS to the level; read once, on their import."""

XLA_FLAG = "--xla_cpu_max_isa=AVX2"

_NEEDED = {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "abm"}


@cache
def can_pin() -> bool:
    """Tests whether this processor has the level; False where Linux does not list its flags."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return False
    flags = next((line for line in lines if line.startswith("flags")), "")
    return set(flags.split()) >= _NEEDED


def level() -> str:
    """Names the level that results are computed at, for their provenance."""
    return LEVEL if can_pin() else "of the processor at hand"
