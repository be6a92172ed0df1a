"""Routines of LAPACK and BLAS for compiled code, on one thread."""

from collections.abc import Callable

import scipy.linalg.cython_blas
import scipy.linalg.cython_lapack  # noqa: F401  (function addresses are looked up below)
from llvmlite import binding
from numba import types
from numba.extending import get_cython_function_address
from threadpoolctl import threadpool_limits

threadpool_limits(1, user_api="blas")  # threads make factorisations of this size 8-30 times slower

_POINTER, _INTEGER, _CHARACTER = (
    types.CPointer(kind)  # type: ignore[no-untyped-call]
    for kind in (types.float64, types.int32, types.uint8)
)
_TYPES = {"d": _POINTER, "i": _INTEGER, "c": _CHARACTER}


def _routine(library: str, name: str, arguments: str) -> Callable[..., None]:
    """Looks a routine of "blas" or "lapack" up, so that compiled callers can be cached.

    The arguments are a letter for each pointer: d double, i integer, c character.
    """
    symbol = f"sim_{name}"
    binding.add_symbol(symbol, get_cython_function_address(f"scipy.linalg.cython_{library}", name))
    kinds = (_TYPES[letter] for letter in arguments)
    made: Callable[..., None] = types.ExternalFunction(symbol, types.void(*kinds))
    return made


dpbtrf = _routine("lapack", "dpbtrf", "ciidii")
dpbtrs = _routine("lapack", "dpbtrs", "ciiididii")
dpotrf = _routine("lapack", "dpotrf", "cidii")
dtrsm = _routine("blas", "dtrsm", "cccciiddidi")
dsyrk = _routine("blas", "dsyrk", "cciiddiddi")
dtrsv = _routine("blas", "dtrsv", "cccididi")
dgemv = _routine("blas", "dgemv", "ciiddididdi")
