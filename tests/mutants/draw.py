"""Draws mutants of modules by the operators of cosmic-ray, in an environment that has it.

Of files of C an operator, a comparison or a number is replaced.

``python draw.py SEED COUNT MODULES...`` prints a line of JSON for each mutant.
"""

import ast
import json
import re
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from random import Random

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator, operator_names

TRIES = 1000
"""Draws of an operator that a module may have no place for."""


@cache
def _operators() -> dict[str, list[str]]:
    """Groups operators: those that replace an operator by each other count once."""
    groups: dict[str, list[str]] = {}
    for name in sorted(name for name in operator_names() if "Variable" not in name):
        groups.setdefault("_".join(name.split("_")[:2]), []).append(name)
    return groups


def _meaning(code: str) -> str:
    """Returns the code without what changes nothing: annotations and docstrings."""
    tree = ast.parse(code)
    for node in ast.walk(tree):
        for name in ("annotation", "returns"):
            if hasattr(node, name):
                setattr(node, name, None if name == "returns" else ast.Name("object"))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            node.value = ast.Constant(None)
    return ast.dump(tree)


def _count(operator: Operator, code: str) -> int:
    return sum(len(list(operator.mutation_positions(node))) for node in ast_nodes(get_ast(code)))


_REPLACED = {
    " + ": (" - ", " * "), " - ": (" + ",), " * ": (" / ", " + "), " / ": (" * ",),
    " < ": (" <= ", " > "), " > ": (" >= ", " < "), " <= ": (" < ",), " >= ": (" > ",),
    " == ": (" != ",), " != ": (" == ",), " && ": (" || ",), " || ": (" && ",),
    " += ": (" -= ",), " -= ": (" += ",), "0.5 *": ("0.25 *",), "2.0 *": ("3.0 *",),
    "[0]": ("[1]",), " + 1]": (" + 2]",), "true": ("false",), "false": ("true",),
}  # fmt: skip
_PLACES = re.compile("|".join(map(re.escape, sorted(_REPLACED, key=len, reverse=True))))
_UNREAD = re.compile(r"/\*.*?\*/|^#.*?$", re.DOTALL | re.MULTILINE)


def _drawn_of_c(path: str, code: str, random: Random) -> dict[str, str]:
    """Replaces one operator or number outside comments and directives."""
    unread = [found.span() for found in _UNREAD.finditer(code)]
    places = [
        found
        for found in _PLACES.finditer(code)
        if not any(first <= found.start() < end for first, end in unread)
    ]
    if not places:
        raise SystemExit(f"nothing to mutate in {path}")
    chosen = random.choice(places)
    new = random.choice(_REPLACED[chosen.group()])
    mutated = code[: chosen.start()] + new + code[chosen.end() :]
    return {"path": path, "operator": f"{chosen.group().strip()} -> {new.strip()}", "code": mutated}


def drawn(path: str, random: Random) -> dict[str, str]:
    """Draws a mutant that means something else than the module."""
    code = Path(path).read_text(encoding="utf-8")
    if path.endswith(".c"):
        return _drawn_of_c(path, code, random)
    meant = _meaning(code)
    for _ in range(TRIES):
        name = random.choice(random.choice(list(_operators().values())))
        operator = get_operator(name)()
        if not (count := _count(operator, code)):
            continue
        mutated = mutate_code(code, operator, random.randrange(count))
        with suppress(SyntaxError):
            if mutated is None or _meaning(mutated) == meant:
                continue
            return {"path": path, "operator": name, "code": mutated}
    raise SystemExit(f"nothing to mutate in {path}")


if __name__ == "__main__":
    order = Random(int(sys.argv[1]))
    modules = sys.argv[3:]
    sizes = [len(Path(each).read_bytes()) for each in modules]
    for chosen in order.choices(modules, sizes, k=int(sys.argv[2])):
        sys.stdout.write(f"{json.dumps(drawn(chosen, order))}\n")
        sys.stdout.flush()
