"""Postpones machine code until somebody asks for it: what only loops call never has any.

Numba optimises every function with all that it calls, and makes machine code of it, though a loop
takes a copy of what it calls and optimises that again. Here a library stays LLVM's intermediate
code, inlined at little cost, until somebody asks for the address of a function in it; when nothing
is being compiled, as bitcode, a tenth of the memory of a module and the copy that is linked with.

Numba also makes the code of an `inlined` loop anew for each call, then copies it twice, block by
block, each with all variables of the loop: here it goes in as it was made. And each process that
compiles an assignment of a slice compiles the text of an error that names the shapes, a second of
work: here that error is a constant.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from types import FunctionType
from typing import Any, Self
from weakref import WeakSet

from llvmlite.binding import ModuleRef, parse_bitcode
from numba.core.cgutils import normalize_ir_text
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.inline_closurecall import InlineWorker
from numba.core.ir import Block
from numba.core.registry import CPUDispatcher, cpu_target
from numba.extending import overload
from numba.np import arrayobj


class Loop(CPUDispatcher):
    """Runs a loop that Python calls; loops that call it take a copy without wrappers for Python."""

    compiler: Callable[[FunctionType, dict[str, Any]], Any]  # with options of Numba

    @property
    def _numba_type_(self) -> Any:  # noqa: ANN401
        return self.callee._numba_type_

    @cached_property
    def callee(self) -> Any:  # noqa: ANN401  (a dispatcher would be taken for a method)
        """The same loop, as those that call it take it: intermediate code, cached as such."""
        loop: Any = self.py_func
        known = (loop.__globals__, loop.__name__, loop.__defaults__, loop.__closure__)
        copied = FunctionType(loop.__code__, *known)
        copied.__qualname__, copied.__module__ = f"{loop.__qualname__}.callee", loop.__module__
        bare = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        return self.compiler(copied, self.targetoptions | bare)


class DeferredLibrary(JITCodeLibrary):
    """Holds the code of one loop, in full optimised and made machine code when that is called."""

    _has_machine_code = False
    _module: ModuleRef | None = None
    _bitcode: bytes | None = None

    @property
    def _final_module(self) -> ModuleRef:
        """Returns the module; one that was packed is read again."""
        if self._module is None:
            assert self._bitcode is not None
            self._final_module = module = parse_bitcode(self._bitcode)
            module.name = normalize_ir_text(self.name)
            return module
        return self._module

    @_final_module.setter
    def _final_module(self, module: ModuleRef) -> None:
        self._module = module
        _open.add(self)

    def pack(self) -> None:
        """Keeps intermediate code as bitcode alone, a tenth of the memory, until it is wanted."""
        if self._finalized and not self._has_machine_code:
            self._bitcode = self._bitcode or self._final_module.as_bitcode()
            self._module = self._shared_module = None  # the latter is a copy to link with

    def get_pointer_to_function(self, name: str) -> int:
        """Returns the address of a function of this library; 0 where it has none of that name."""
        self._ensure_finalized()
        if not self._has_machine_code:
            if name not in {function.name for function in self.get_defined_functions()}:
                return 0
            super()._optimize_final_module()
            self._make_machine_code()
        return int(super().get_pointer_to_function(name))

    def serialize_using_object_code(self) -> tuple[str, str, Any]:
        """Returns what is cached: intermediate code, with machine code where there is any."""
        if self._has_machine_code:
            return super().serialize_using_object_code()
        return self.serialize_using_bitcode()

    def _optimize_functions(self, ll_module: Any) -> None:  # noqa: ANN401
        """Tidies each function before it is inlined; what calls it optimises it in full."""
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager(opt=1)
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        """Inlines, and prunes counts of references: what calls it optimises it in full."""
        passes, builder = self._codegen._module_pass_manager(
            loop_vectorize=False, slp_vectorize=False, opt=0, cost="cheap"
        )
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        if self._object_caching_enabled and self._compiled_object:  # comes from the cache
            self._make_machine_code()
        else:
            self._finalize_dynamic_globals()
            self._verify_declare_only_symbols()
            self._finalized = True

    def _make_machine_code(self) -> None:
        self._has_machine_code = True
        self._dynamic_globals = []
        super()._finalize_final_module()


_open: WeakSet[DeferredLibrary] = WeakSet()
"""Libraries whose modules are in memory."""


def pack_all() -> None:
    """Packs all libraries; to be called when nothing is being compiled."""
    while _open:
        _open.pop().pack()


def install() -> None:
    """Makes Numba compile so in this process."""
    worker: Any = InlineWorker
    worker.inline_function = _inline_function
    arrays: Any = arrayobj
    arrays.raise_with_shape_context = _refuse
    codegen: Any = cpu_target.target_context.codegen()
    codegen._library_class = DeferredLibrary
    codegen.set_env = _set_env.__get__(codegen)


def _set_env(codegen: JITCPUCodegen, name: str, environment: object) -> None:
    """Sets the environment of a function that has machine code."""
    if codegen._engine.is_symbol_defined(name):
        JITCPUCodegen.set_env(codegen, name, environment)


class _Owned(Block):
    """Holds a block of which nobody else knows: its copy is itself."""

    def __deepcopy__(self, _: object) -> Self:
        return self


def _inline_function(
    worker: Any,  # noqa: ANN401  (Numba's own, untyped, as is its intermediate code)
    caller: Any,  # noqa: ANN401
    block: Block,
    place: int,
    function: FunctionType,
    types: Any = None,  # noqa: ANN401
) -> Any:  # noqa: ANN401
    """Puts the code of a function in place of a call of it."""
    code = worker.run_untyped_passes(function)
    with _owned(list(code.blocks.values())):
        free = function.__code__.co_freevars
        return worker.inline_ir(caller, block, place, code, free, types)


@contextmanager
def _owned(blocks: list[Block]) -> Iterator[None]:
    """Lets copies of blocks be these, as long as it lasts."""
    for block in blocks:
        block.__class__ = _Owned
    try:
        yield
    finally:
        for block in blocks:
            block.__class__ = Block


def _refuse(given: Any, place: Any) -> Any:  # noqa: ANN401  (shapes, or their types)
    raise NotImplementedError


@overload(_refuse)
def _refuse_compiled(given: Any, place: Any) -> Any:  # noqa: ANN401, ARG001
    def refuse(given: Any, place: Any) -> Any:  # noqa: ANN401, ARG001
        raise ValueError("a slice is assigned one of a different size")

    return refuse
