"""Hands routines of LAPACK and BLAS to compiled code, those that SciPy brings, on one thread."""

import ctypes

import scipy.linalg.cython_blas
import scipy.linalg.cython_lapack
from threadpoolctl import threadpool_limits

from sim.core import LIBRARY

threadpool_limits(1, user_api="blas")  # threads make factorisations of this size 8-30 times slower

_ROUTINES = {
    scipy.linalg.cython_lapack: ("dpbtrf", "dpbtrs", "dpotrf"),
    scipy.linalg.cython_blas: ("dtrsm", "dsyrk", "dtrsv", "dgemv"),
}


@LIBRARY.prepared
def hand_over(library: ctypes.CDLL) -> None:
    """Fills the pointers of ``lapack.c``."""
    for module, names in _ROUTINES.items():
        for name in names:
            pointer = ctypes.c_void_p.in_dll(library, f"lapack_{name}")
            pointer.value = _address(module.__pyx_capi__[name])


def _address(capsule: object) -> int:
    """Reads the address in a capsule of Cython, whose name is the routine's signature."""
    name_of, address_in = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    address_in.restype = ctypes.c_void_p
    address_in.argtypes = [ctypes.py_object, ctypes.c_char_p]
    return int(address_in(capsule, name_of(capsule)))
