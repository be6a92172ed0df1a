"""The rules that keep the house in order: rooms, arrows, names."""

import ast
import re
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter

import pytest

from pipeline.runtime import ROOT
from tests.house.project import PACKAGES, Module, forget, module_names, modules, resolved

LARGE = {"pipeline/stages", "pipeline/problem/sections", "docs/examples"}
FLOORS = {
    "sim": (
        {"core"},
        {"linalg", "structure", "optimise"},
        {"collision", "constraints"},
        {"energy"},
        {"solvers", "vibration"},
        {"quasistatics", "time_integration"},
        {"scene"},
        {"load_family"},
    ),
    "pipeline": (
        {"runtime"},
        {"problem"},
        {"datasets"},
        {"posing"},
        {"tracking", "fabrication"},
        {"virtual_lab", "comparison"},
        {"calibration"},
        {"stages", "workflow"},
    ),
    "reports": ({"base"}, {"study"}, {"panels", "facts"}, {"page"}, {"figures"}, {"products"}),
}
HEAVY = {
    "av", "cv2", "daqp", "diffrax", "ezdxf", "jax", "lxml", "manifold3d", "matplotlib", "netCDF4",
    "numpy", "pandas", "pint", "reportlab", "scipy", "shapely", "snakemake", "svgelements",
    "tqdm", "trimesh", "xarray", "xml",
}  # fmt: skip
LIGHT = HEAVY - {"lxml", "numpy", "scipy", "snakemake", "tqdm", "xml"}
READING = LIGHT - {"pint"}  # which reads the quantities of a problem
OPENINGS = ("What", "How", "Which", "Where", "Whether", "Why", "When")
NOUNS = {"Arrays", "Derivatives", "Gaps", "Outlines", "Settings", "Units", "Zeros"}
ALIASED = {"NDArray[np.bool_]", "NDArray[np.float64]", "NDArray[np.int64]", "NDArray[np.uint8]"}
SHORTEST = 80
FRAGMENTS = {
    "pipeline.datasets.seal",
    "pipeline.posing.dispersion",
    "reports.paper_figures",
    "sim.optimise.quasi_newton",
}
"""Shorter modules with one importer that are a concept of their own; there are to be no more."""
LOCAL_WORDS = ("asked", "told", "wanted", "beside", "whole", "casebook", "meeting", "strangers",
               "admission", "checked", "course", "reconsider", "filmed", "soundness",
               "crooked", "agility", "alike", "unlikeness", "likeness", "looks", "everywhere",
               "resting", "retreat", "promised", "lose", "unsure", "tried", "followed", "pulled",
               "worse", "way", "ways", "gone", "apart", "moved", "unclaimed", "untimed",
               "stands", "carried", "eye")  # fmt: skip
FEWEST_LOCAL_WORDS = 4


@pytest.fixture(scope="module", autouse=True)
def _trees_end_with_these_tests() -> Iterator[None]:
    yield
    forget()


def test_folders_hold_few_modules() -> None:
    count = Counter(str(m.path.parent.relative_to(ROOT)) for m in modules() if not m.is_face)
    for tests in (ROOT / "tests", ROOT / "docs/examples"):
        count.update(str(path.parent.relative_to(ROOT)) for path in tests.rglob("*.py"))
    most = {name: 30 if name in LARGE or name.startswith("tests") else 14 for name in count}
    assert {name: n for name, n in count.items() if n > most[name]} == {}


@pytest.mark.parametrize("package", FLOORS)
def test_imports_between_rooms_go_down(package: str) -> None:
    floor = {room: n for n, rooms in enumerate(FLOORS[package]) for room in rooms}
    up = {
        f"{module.name} -> {name}"
        for module in modules(package)
        for name in module.imported_modules()
        for mine, other in [(module.name.split("."), name.split("."))]
        if other[0] == package and len(mine) > 2 and len(other) > 2 and mine[1] != other[1]
        if floor[other[1]] >= floor[mine[1]]
    }
    assert up == set()


def test_packages_import_only_those_below() -> None:
    below = {"sim": set(), "pipeline": {"sim"}, "reports": {"sim", "pipeline"}}
    wrong = {
        f"{module.name} -> {name}"
        for package, allowed in below.items()
        for module in modules(package)
        for _, name in module.imports()
        if name.split(".")[0] not in allowed | {package}
    }
    assert wrong == set()


def test_no_modules_import_one_another_in_a_circle() -> None:
    graph = {m.name: m.imported_modules() - {m.name} for m in modules() if not m.is_face}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as circle:
        pytest.fail(" -> ".join(circle.args[1]))


def test_other_folders_are_imported_through_their_faces() -> None:
    behind = {
        f"{module.name}: {name}"
        for module in modules()
        for _, name in module.imports()
        if name in module_names() and name.rpartition(".")[0] not in (module.folder, *PACKAGES)
    }
    assert behind == set()


def test_nothing_of_the_project_is_imported_inside_a_function() -> None:
    late = {
        f"{module.name}:{node.lineno}"
        for module in modules()
        if module.path.name != "__main__.py"
        for function in ast.walk(module.tree)
        if isinstance(function, ast.FunctionDef)
        for node in ast.walk(function)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in _named(node)
        if name.split(".")[0] not in HEAVY
    }
    assert late == set()


def _named(node: ast.Import | ast.ImportFrom) -> list[str]:
    return [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]


def test_a_public_class_is_defined_once() -> None:
    places = defaultdict(list)
    for module in modules("sim", "pipeline", "reports"):
        for node in module.tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(module.name)
    assert {name: found for name, found in places.items() if len(found) > 1} == {}


def test_a_module_with_one_importer_is_no_fragment() -> None:
    importers = defaultdict(set)
    for module in modules():
        for name in module.imported_modules():
            importers[name].add(module.name)
    exempt = re.compile(
        r"pipeline\.(stages|datasets\.tables|problem\.sections|workflow)\.|reports\.catalogue|benchmarks"
    )
    fragments = {
        module.name
        for module in modules()
        if len(importers[module.name]) == 1 and module.lines < SHORTEST and not module.is_face
        if not exempt.match(module.name)
        if not any(module.path.with_suffix(kind).exists() for kind in (".c", ".yaml"))
    }
    assert fragments <= FRAGMENTS


def test_docstrings_open_with_a_verb() -> None:
    indirect = {
        f"{module.name}:{getattr(node, 'lineno', 1)} {text.split()[0]}"
        for module in modules()
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef)
        if (text := ast.get_docstring(node)) and text.split()[0].strip(",:") in OPENINGS
    }
    assert indirect == set()


def test_docstrings_of_the_physics_say_what_is_done() -> None:
    """Those of properties may open with the shape of their value, other ones with a verb."""
    nouns = {
        f"{module.name}:{getattr(node, 'lineno', 1)} {text.split()[0]}"
        for module in modules("sim")
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef)
        if not any("property" in ast.unparse(e) for e in getattr(node, "decorator_list", []))
        if (text := ast.get_docstring(node)) and not text.startswith("See ``")
        if not (word := text.split()[0].strip(",:;")).endswith("s") or word in NOUNS
    }
    assert nouns == set()


def test_names_are_of_the_field() -> None:
    local = {
        f"{module.name}: {name}"
        for module in modules("sim", "pipeline", "reports")
        for name in _defined(module)
        if set(name.lower().split("_")) & set(LOCAL_WORDS)
    }
    assert len(local) <= FEWEST_LOCAL_WORDS, sorted(local)


def _defined(module: Module) -> set[str]:
    """A module's own name, and those of its public classes and functions."""
    own = [module.path.stem]
    kinds = (ast.ClassDef, ast.FunctionDef)
    own += [node.name for node in module.tree.body if isinstance(node, kinds)]
    return {name for name in own if not name.startswith("_")}


@pytest.mark.parametrize("package", PACKAGES)
def test_types_of_arrays_are_named_once(package: str) -> None:
    again = {
        module.name
        for module in modules(package)
        for node in module.tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.value) in ALIASED
    }
    assert again == set()


def test_a_face_shows_no_name_of_one_of_its_modules() -> None:
    hidden = {
        f"{stub.parent.relative_to(ROOT)}: {alias.name}"
        for package in PACKAGES
        for stub in (ROOT / package).rglob("__init__.pyi")
        for node in ast.parse(stub.read_text()).body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
        if (stub.parent / f"{alias.name}.py").exists()
    }
    assert hidden == set()


def test_all_names_of_a_face_are_there() -> None:
    missing = {
        f"{stub.parent}: {alias.name}"
        for package in PACKAGES
        for stub in (ROOT / package).rglob("__init__.pyi")
        for base in [".".join(stub.parent.relative_to(ROOT).parts)]
        for node in ast.parse(stub.read_text()).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if not any((ROOT / source.replace(".", "/")).with_suffix(".py").exists()
                   or (ROOT / source.replace(".", "/")).is_dir()
                   for source in resolved(base, alias.name))
    }  # fmt: skip
    assert missing == set()


STARTS = (
    ("import sim; dir(sim)", LIGHT),
    ("from pipeline.workflow import rule_inputs", LIGHT),
    ("from pipeline.workflow.rule_inputs import check_problems as c; c(['fig2'])", READING),
    ("from pipeline.problem import load; load('experiments/fig2/problem.yaml')", READING),
)


def test_what_every_start_imports_is_light() -> None:
    """One process makes them all, one after the other: what one of them imports stays."""
    lines = ["import sys"]
    for start, absent in STARTS:
        lines += [start, f"print(*[{start!r}, *sorted(set(sys.modules) & {absent})], sep='|')"]
    words = [sys.executable, "-c", "\n".join(lines)]
    told = subprocess.check_output(words, cwd=ROOT, text=True).splitlines()
    assert told == [start for start, _ in STARTS]
