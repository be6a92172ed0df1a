"""Binds functions of Python to their definitions in C, compiled once on a machine.

A decorated function declares: its annotations give the types, its docstring says what it does, and
its body is empty. The file of the same name that ends in ``.c`` defines it: the name of the file,
``_``, that of the function. Of several numbers that it returns, C fills an array ``returned``.
All declarations stand in one header, which the compiler compares with the definitions.
"""

import ctypes
import inspect
from collections.abc import Callable, Sequence
from functools import cached_property, wraps
from pathlib import Path
from threading import Lock, RLock
from typing import Any, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np

from sim.core import c_types, compiler

F = TypeVar("F", bound=Callable[..., Any])
Preparation = Callable[[ctypes.CDLL], None]

HEADER = "declarations.h"
_BINDING = RLock()
"""Held while a function is bound: threads may call it for the first time at once."""


class CLibrary:
    """Holds what the files of C below a folder define.

    Args:
        folder: theirs.
        flags: options of the compiler besides those of all.
    """

    def __init__(self, folder: Path, flags: Sequence[str] = ()) -> None:
        self.folder, self.flags = folder, tuple(flags)
        self.functions: list[CFunction] = []
        self._prepare: list[Preparation] = []
        self._lock = Lock()

    def compiled(self, function: F) -> F:
        """Declares a function that is defined in C."""
        bound = CFunction(self, function)
        self.functions.append(bound)

        @wraps(function)
        def call(*arguments: Any) -> Any:  # noqa: ANN401
            return bound.call(*arguments)

        return cast(F, call)

    def prepared(self, prepare: Preparation) -> Preparation:
        """Has the library prepared by a function as soon as it is loaded."""
        self._prepare.append(prepare)
        return prepare

    @property
    def code(self) -> ctypes.CDLL:
        """Compiles the library where that is not done yet, and loads it."""
        with self._lock:
            return self._code

    @cached_property
    def _code(self) -> ctypes.CDLL:
        loaded = compiler.load(self.folder, self.flags)
        for prepare in self._prepare:
            prepare(loaded)
        return loaded

    @property
    def header_file(self) -> Path:
        """Names the header of all declarations."""
        return self.folder / HEADER

    @cached_property
    def header(self) -> str:
        """Reads the declarations that the library is compiled with."""
        return self.header_file.read_text(encoding="utf-8")

    def declarations(self) -> str:
        """Writes the header of all functions that are declared by now."""
        functions = sorted(self.functions, key=lambda each: each.symbol)
        records = dict.fromkeys(
            record
            for function in functions
            for hint in function.hints.values()
            for record in c_types.records_of(hint)
        )
        return "\n".join(
            [
                "/* Written by `python -m pipeline declarations` from the types and functions of"
                " Python. */",
                f"#ifndef {self.folder.name.upper()}_DECLARATIONS_H",
                f"#define {self.folder.name.upper()}_DECLARATIONS_H",
                "",
                "#include <stdbool.h>",
                "#include <stdint.h>",
                "",
                *(f"{c_types.declaration(record)}\n" for record in records),
                *(function.prototype for function in functions),
                "",
                "#endif",
                "",
            ]
        )


class CFunction:
    """Holds a function that Python declares and C defines."""

    def __init__(self, library: CLibrary, function: Callable[..., Any]) -> None:
        self._library, self._function = library, function
        self._bound: Callable[..., Any] | None = None

    @property
    def module(self) -> str:
        """Names the file that declares the function, and the one that defines it."""
        return self._function.__module__.rpartition(".")[2]

    @property
    def symbol(self) -> str:
        """Names the function in C."""
        return f"{self.module}_{self._function.__name__.lstrip('_')}"

    @cached_property
    def hints(self) -> dict[str, Any]:
        """Returns the types of the arguments by name, and that of the result."""
        return get_type_hints(self._function)

    @property
    def _arguments(self) -> dict[str, c_types.CType]:
        names = inspect.signature(self._function).parameters
        return {name: c_types.argument(self.hints[name]) for name in names}

    @property
    def _returned(self) -> tuple[Any, ...]:
        """Returns the types of several numbers; of one or none, nothing."""
        hint = self.hints["return"]
        return get_args(hint) if get_origin(hint) is tuple else ()

    @property
    def prototype(self) -> str:
        """Declares the function in C."""
        arguments = [f"{kind.name}{name}" for name, kind in self._arguments.items()]
        if self._returned:
            return f"void {self.symbol}({', '.join([*arguments, 'double *returned'])});"
        kind, _ = c_types.result(self.hints["return"])
        return f"{kind} {self.symbol}({', '.join(arguments)});"

    @property
    def call(self) -> Callable[..., Any]:
        """Returns the function in C, bound by the first thread that asks for it."""
        with _BINDING:
            if self._bound is None:
                self._bound = self._bind()
        return self._bound

    def _bind(self) -> Callable[..., Any]:
        """Binds the definition in C.

        Raises:
            ImportError: the library was compiled with other declarations.
        """
        records = [each for hint in self.hints.values() for each in c_types.records_of(hint)]
        for told in (self.prototype, *map(c_types.declaration, records)):
            if told not in self._library.header:
                raise ImportError(
                    f"{self._library.header_file} does not declare {self.symbol} as Python"
                    " does: run `python -m pipeline declarations`"
                )
        kinds = list(self._arguments.values())
        packers = [kind.pack for kind in kinds]
        defined = getattr(self._library.code, self.symbol)
        defined.argtypes = [kind.passed for kind in kinds]
        counted = self._counted

        def pack(arguments: tuple[Any, ...]) -> list[Any]:
            counts = [len(arguments[place]) for place in counted]
            return [make(each) for make, each in zip(packers, (*arguments, *counts), strict=True)]

        if self._returned:
            return _several(defined, pack, self._returned)
        defined.restype = c_types.result(self.hints["return"])[1]
        return lambda *arguments: defined(*pack(arguments))

    @property
    def _counted(self) -> list[int]:
        """Lists the places of the arrays whose rows the last arguments count, left out in calls.

        Such an argument is named ``n_`` and the name of the array.
        """
        names = list(self._arguments)
        return [
            names.index(name[2:])
            for name in names
            if name[2:] in names
            and name.startswith("n_")
            and c_types.is_array(self.hints[name[2:]])
        ]


def _several(
    defined: Any,  # noqa: ANN401  (of ctypes)
    pack: Callable[[tuple[Any, ...]], list[Any]],
    kinds: tuple[Any, ...],
) -> Callable[..., Any]:
    """Binds a function that returns several numbers."""
    defined.argtypes = [*defined.argtypes, ctypes.c_void_p]
    defined.restype = None

    def call(*arguments: Any) -> Any:  # noqa: ANN401
        returned = np.empty(len(kinds))
        defined(*pack(arguments), returned.__array_interface__["data"][0])
        return tuple(kind(each) for kind, each in zip(kinds, returned.tolist(), strict=True))

    return call
