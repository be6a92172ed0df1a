"""Libraries and generated code keep to the level, on a processor that has more."""

import subprocess
import sys
from pathlib import Path

from pipeline.runtime import ROOT
from sim.core.instruction_set import can_pin

REPORT = """
import pipeline
import subprocess, numpy, scipy.linalg
from pathlib import Path
from threadpoolctl import threadpool_info
from sim.core import compiler

chosen = compiler.compiler(Path(__file__).parent)
shown = [*chosen, *compiler.options(), "-I.", "-S", "-o", "-", "sim/linalg/panels.c"]
shown.remove("-shared")
code = subprocess.run(shown, capture_output=True, text=True, check=True).stdout
assert "%ymm" in code, "not vectorised at all"
print("C", "%zmm" in code)
module = numpy._core._multiarray_umath
print("numpy", *(name for name in module.__cpu_dispatch__ if module.__cpu_features__[name]))
print("blas", *sorted({row["architecture"] for row in threadpool_info() if "architecture" in row}))
"""


def test_libraries_and_loops_keep_to_the_level(tmp_path: Path) -> None:
    assert can_pin(), "this processor lacks AVX2: results differ in their last bits"
    (tmp_path / "report.py").write_text(REPORT)
    done = subprocess.run(
        [sys.executable, tmp_path / "report.py"], cwd=ROOT, capture_output=True, text=True,
        check=True, env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin", "HOME": str(Path.home())},
    )  # fmt: skip
    assert done.stdout.splitlines() == ["C False", "numpy X86_V3", "blas Haswell"]


def test_xla_obeys(tmp_path: Path) -> None:
    """Its flags are read up to the first that it does not know."""
    dump = f"import os, pipeline; os.environ['XLA_FLAGS'] += ' --xla_dump_to={tmp_path}'"
    script = f"{dump}\nimport jax\njax.jit(lambda x: x + 1)(1.0)"
    subprocess.run([sys.executable, "-c", script], cwd=ROOT, check=True, capture_output=True)
    options = [path.read_text() for path in tmp_path.glob("*debug_options")]
    assert options
    assert all('xla_cpu_max_isa: "AVX2"' in text for text in options)
