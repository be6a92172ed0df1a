"""Runs commands by the names that they had: `python -m pipeline.track` for one more release."""

import sys
from collections.abc import Mapping, Sequence
from importlib.abc import InspectLoader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import CodeType, ModuleType

from pipeline.runtime.locations import INSTALLED

_CODE = """
import sys
from {package}.__main__ import main
print("note: python -m {old} is now python -m {package} {new}", file=sys.stderr)
sys.exit(main(["{new}", *sys.argv[1:]]))
"""


class _OldCommands(MetaPathFinder, InspectLoader):
    """Finds modules that there are no more, each of which runs a command of its package."""

    def __init__(self, package: str, commands: Mapping[str, str]) -> None:
        self._package = package
        self._commands = {f"{package}.{old}": new for old, new in commands.items()}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Names this loader for a module of the table, or a package that held one."""
        del path, target
        held = any(old.startswith(f"{fullname}.") for old in self._commands)
        if not held and fullname not in self._commands:
            return None
        return ModuleSpec(fullname, self, is_package=held)

    def get_code(self, fullname: str) -> CodeType:
        """Compiles what `python -m` runs."""
        source = self.get_source(fullname)
        return self.source_to_code(source, f"<{fullname}>")

    def get_source(self, fullname: str) -> str:
        """Writes a program that hands its words to the command of today; nothing for a package."""
        new = self._commands.get(fullname)
        return "" if new is None else _CODE.format(package=self._package, old=fullname, new=new)


def keep_old_commands(package: str, commands: Mapping[str, str]) -> None:
    """Lets `python -m package.old` run the command `new` of a package, with a note."""
    if not INSTALLED:  # as a package it had none
        sys.meta_path.append(_OldCommands(package, commands))
