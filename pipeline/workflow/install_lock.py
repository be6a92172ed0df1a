"""Installs a lock into the environment that runs this: by uv, or by pip where uv cannot be had.

``python install_lock.py LOCK [--wheels FOLDER]`` needs nothing but pip. uv comes from the lock as
well; it is told the settings of pip by its environment, since command lines are seen by others.
Byte code is left to the first import, unless Python is told to write none then.
"""

import argparse
import ast
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import NamedTemporaryFile

_UV_NAMES = {
    "index-url": ("UV_DEFAULT_INDEX",),
    "extra-index-url": ("UV_INDEX",),
    "find-links": ("UV_FIND_LINKS",),
    "no-index": ("UV_NO_INDEX",),
    "trusted-host": ("UV_INSECURE_HOST",),
    "cert": ("SSL_CERT_FILE",),
    "client-cert": ("SSL_CLIENT_CERT",),
    "proxy": ("HTTP_PROXY", "HTTPS_PROXY"),
    "timeout": ("UV_HTTP_TIMEOUT",),
    "default-timeout": ("UV_HTTP_TIMEOUT",),
    "retries": ("UV_HTTP_RETRIES",),
}
"""Variables of uv by the settings of pip, in the order in which later ones prevail."""
_SECTIONS = ("global", "install", ":env:")
"""Places of settings of `pip install`, in the order in which later ones prevail."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Installs the lock; returns the exit code of what did, or did not."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("lock", type=Path, help="pinned packages with hashes")
    parser.add_argument("--wheels", type=Path, help="take all from this folder, without a network")
    asked = parser.parse_args(arguments)
    where = ["--no-index", "--find-links", str(asked.wheels)] if asked.wheels else []
    install = ["install", "--quiet", "--require-hashes", *where]
    pip = [sys.executable, "-m", "pip", *install, "--disable-pip-version-check"]
    pip += ["-r"] if sys.dont_write_bytecode else ["--no-compile", "-r"]
    if _install_uv(pip, asked.lock):
        uv = [str(Path(sys.executable).with_name("uv")), "pip", *install, "-r", str(asked.lock)]
        uv += ["--python", sys.executable, "--index-strategy", "unsafe-best-match"]
        uv += ["--compile-bytecode"] if sys.dont_write_bytecode else []
        if subprocess.run(uv, env=_uv_environment(), check=False).returncode == 0:
            return 0
    sys.stderr.write("uv cannot install here, pip does: a few minutes\n")
    return subprocess.run([*pip, str(asked.lock)], check=False).returncode


def uv_settings(listed: str) -> dict[str, str]:
    """Translates settings of pip, as `pip config list` lists them, to variables of uv.

    Folders of packages that are not there are left out: pip passes over them, uv gives up.
    """
    lines = [line.partition("=")[::2] for line in listed.splitlines()]
    given = {key: ast.literal_eval(value) for key, value in lines if value}
    found = {}
    for section in _SECTIONS:
        for setting, names in _UV_NAMES.items():
            words = str(given.get(f"{section}.{setting}", "")).split()
            if setting == "find-links":
                words = [word for word in words if _is_there(word)]
            separator = "," if setting == "find-links" else " "
            found.update(dict.fromkeys(names, separator.join(words)) if words else {})
    return found


def _is_there(place: str) -> bool:
    return bool(re.match(r"https?:", place)) or Path(place.removeprefix("file://")).exists()


def _uv_environment() -> dict[str, str]:
    """Returns the variables for uv: settings of pip, unless its own are there."""
    command = [sys.executable, "-m", "pip", "config", "list"]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    own = {name: value for name, value in os.environ.items() if name.startswith("UV_")}
    return os.environ | uv_settings(listed) | own


def _install_uv(pip: Sequence[str], lock: Path) -> bool:
    """Installs the uv of a lock; False where the lock has none or it cannot be had."""
    pinned = re.search(r"^uv==(.*\\\n)*.*$", lock.read_text(encoding="utf-8"), re.MULTILINE)
    if pinned is None:
        return False
    with NamedTemporaryFile("w", suffix=".lock") as alone:
        alone.write(pinned[0])
        alone.flush()
        return subprocess.run([*pip, alone.name], check=False).returncode == 0


if __name__ == "__main__":
    sys.exit(main())
