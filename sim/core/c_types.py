"""Maps the types of Python's declarations to those of C: numbers, arrays, and records of them.

A record is a `NamedTuple`. Each of its arrays is a pointer in C, followed by the number of its
rows, ``n_`` and its name; a record in it is a part of it.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

_ELEMENTS: dict[Any, str] = {
    np.float64: "double",
    np.float32: "float",
    np.int64: "int64_t",
    np.bool_: "bool",
    np.uint8: "uint8_t",
}
_NUMBERS: dict[Any, tuple[str, Any]] = {
    float: ("double", ctypes.c_double),
    int: ("int64_t", ctypes.c_int64),
    bool: ("bool", ctypes.c_bool),
}

Packer = Callable[[Any], Any]

KEPT, SMALL = 3, 4 << 20
"""Records of a type that are kept when they have been passed, and bytes of their arrays at most."""

_KEYWORDS = {"void", "double", "float", "int", "long", "short", "char", "register", "restrict"}


class CType(NamedTuple):
    """Holds a type of C, as it is written and as it is passed."""

    name: str  # as in "double *" or "const System *"
    passed: Any  # of ctypes
    pack: Packer  # makes of a value of Python what is passed


def argument(hint: Any) -> CType:  # noqa: ANN401  (a type)
    """Returns the type of an argument.

    Raises:
        TypeError: C has no such type here.
    """
    if hint in _NUMBERS:
        name, passed = _NUMBERS[hint]
        return CType(f"{name} ", passed, passed)
    if is_record(hint):
        pointer = ctypes.POINTER(_structure(hint))
        return CType(f"const {hint.__name__} *", pointer, _reference(hint))
    return CType(f"{_element(hint)} *", ctypes.c_void_p, _address_of(hint))


def result(hint: Any) -> tuple[str, Any]:  # noqa: ANN401  (a type)
    """Returns the name and the type of ctypes of what a function returns: a number, or nothing."""
    if hint is type(None):
        return "void", None
    return _NUMBERS[hint]


def c_name(name: str) -> str:
    """Returns the name of a field in C, where a keyword gets an underscore."""
    return f"{name}_" if name in _KEYWORDS else name


def is_array(hint: Any) -> bool:  # noqa: ANN401  (a type)
    """Tests whether a type is that of an array."""
    return get_origin(hint) is np.ndarray


def is_record(hint: Any) -> bool:  # noqa: ANN401  (a type)
    """Tests whether a type is a record."""
    return isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields")


def records_of(hint: Any) -> list[Any]:  # noqa: ANN401  (a type)
    """Lists a record and those in it, inner ones first; none for other types."""
    if not is_record(hint):
        return []
    inner = [each for kind in get_type_hints(hint).values() for each in records_of(kind)]
    return [*inner, hint]


def declaration(record: Any) -> str:  # noqa: ANN401  (a type)
    """Writes a record as a structure of C."""
    lines = []
    for name, hint in get_type_hints(record).items():
        if is_record(hint):
            lines.append(f"    {hint.__name__} {c_name(name)};")
        elif hint in _NUMBERS:
            lines.append(f"    {_NUMBERS[hint][0]} {name};")
        else:
            lines += [f"    {_element(hint)} *{c_name(name)};", f"    int64_t n_{name};"]
    return "\n".join(["typedef struct {", *lines, f"}} {record.__name__};"])


def _element(hint: Any) -> str:  # noqa: ANN401  (a type)
    return _ELEMENTS[_dtype(hint)]


def _dtype(hint: Any) -> Any:  # noqa: ANN401  (a type)
    if get_origin(hint) is not np.ndarray:
        raise TypeError(f"C takes numbers, arrays and records, not {hint}")
    return get_args(get_args(hint)[1])[0]


@cache
def _structure(record: Any) -> Any:  # noqa: ANN401  (a type)
    fields: list[tuple[str, Any]] = []
    for name, hint in get_type_hints(record).items():
        if is_record(hint):
            fields.append((name, _structure(hint)))
        elif hint in _NUMBERS:
            fields.append((name, _NUMBERS[hint][1]))
        else:
            fields += [(name, ctypes.c_void_p), (f"n_{name}", ctypes.c_int64)]
    return type(record.__name__, (ctypes.Structure,), {"_fields_": fields})


@cache
def packer(record: Any) -> Packer:  # noqa: ANN401  (a type)
    """Makes the function that fills the structure of a record; the arrays stay where they are."""
    structure = _structure(record)
    parts: list[tuple[bool, Packer]] = []
    for hint in get_type_hints(record).values():
        if is_record(hint):
            parts.append((False, packer(hint)))
        elif hint in _NUMBERS:
            parts.append((False, hint))
        else:
            parts.append((True, _address_of(hint)))

    def pack(value: Any) -> Any:  # noqa: ANN401  (a record)
        filled: list[Any] = []
        for each, (is_array, pack_one) in zip(value, parts, strict=True):
            filled.append(pack_one(each))
            if is_array:
                filled.append(len(each))
        return structure(*filled)

    return pack


@cache
def _reference(record: Any) -> Packer:  # noqa: ANN401  (a type)
    """Makes the function that packs a record and refers to it, once for many calls.

    Short calls in a row take the same system and workspace, and take less time than packing these.
    The last records are kept if they are small: as long as they live, their arrays stay in place.
    """
    pack = packer(record)
    last: tuple[tuple[Any, Any], ...] = ()

    def refer(value: Any) -> Any:  # noqa: ANN401  (a record)
        nonlocal last
        for known, packed in last:
            if known is value:
                return ctypes.byref(packed)
        packed = pack(value)
        if _size(value) <= SMALL:
            last = ((value, packed), *last[: KEPT - 1])
        return ctypes.byref(packed)

    return refer


def _size(value: Any) -> int:  # noqa: ANN401  (of a record)
    """Sums up the bytes of all arrays."""
    if isinstance(value, tuple):
        return sum(map(_size, value))
    return value.nbytes if isinstance(value, np.ndarray) else 0


@cache
def _address_of(hint: Any) -> Packer:  # noqa: ANN401  (a type)
    dtype = np.dtype(_dtype(hint))

    def address(array: Any) -> int:  # noqa: ANN401
        if array.dtype != dtype or not array.flags.c_contiguous:
            kind = "contiguous" if array.dtype == dtype else f"of {dtype}"
            raise TypeError(f"C takes an array that is {kind}, not {array.dtype}{array.shape}")
        return int(array.__array_interface__["data"][0])

    return address
