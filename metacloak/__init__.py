"""Designs, simulates, builds, films and compares mechanical metamaterial cloaks.

Installed, `sim`, `pipeline` and `reports` lie in this package. In a checkout they lie beside it,
and `metacloak.sim` is `sim` itself: one module under two names.
"""

import importlib
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

__all__ = ["pipeline", "reports", "sim"]

_HERE = Path(__file__).resolve().parent
_ROOMS = tuple(f"{__name__}.{room}" for room in __all__)


def __getattr__(name: str) -> ModuleType:
    """Imports a room when it is first named."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return importlib.import_module(f"{__name__}.{name}")


class _CheckoutFinder(MetaPathFinder, Loader):
    """Finds `metacloak.sim.x` as `sim.x`, which lies beside this package in a checkout."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Names this loader for the rooms and all that is in them."""
        del path, target
        if ".".join(fullname.split(".")[:2]) not in _ROOMS:
            return None
        return ModuleSpec(fullname, self)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Imports the module under its own name."""
        module = importlib.import_module(spec.name.removeprefix(f"{__name__}."))
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Gives the module back the spec that the import of its second name has overwritten."""
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state


if not (_HERE / "sim").is_dir():
    sys.meta_path.insert(0, _CheckoutFinder())
    if find_spec("sim") is None:
        sys.path.append(str(_HERE.parent))
