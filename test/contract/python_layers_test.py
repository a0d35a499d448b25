"""Rooms of python/ksl: none imports a higher one, not even inside functions or for annotations, and none uses private names of another."""

import ast
from graphlib import TopologicalSorter

import pytest
from modules_test import PYTHON, imports, module_name

COMPILED = {"_core", "_ufuncs"}
TOP = "the public names"
FACES = {"ksl", "ksl.__main__", "ksl.mjcf", "ksl.identification", "ksl.base_parameters", "ksl.consistency", "ksl.simulation", "ksl.jax", "ksl.torch"}
"""Modules of the root that only show what others have, or start the command: they may import every room, and no room imports them."""

ALLOWED: dict[str, set[str]] = {
    # room: the rooms that it may import, beside the compiled modules
    "base": set(),
    "output": set(),
    "arrays": {"base"},
    "model": {"base", "output"},
    "operators": {"model"},
    "identify": {"base", "model"},
    "comparison": {"base", "model"},
    "motions.signal": {"base", "model"},
    "motions.columns": {"base", "model"},
    "motions.files": {"base", "model", "motions.signal", "motions.columns"},
    "motions": {"base", "model", "motions.signal", "motions.columns", "motions.files"},
    "motions.generate": {"base", "output", "model", "identify", "motions", "motions.signal", "motions.columns", "motions.files"},
    "checks": {"base", "output", "model", "identify"},
    "load_cases": {"base", "model", "motions", "motions.signal", "motions.columns", "motions.files"},
    "sizing": {"base", "output", "model", "load_cases"},
    "viewer": {"base", "output", "model", "motions"},
    "sweeps": {"base", "output", "model", "motions", "load_cases", "sizing"},
    "report": {"base", "output", "model", "motions", "load_cases", "sizing", "viewer"},
    "commands": {
        "base", "output", "model", "motions", "motions.files", "motions.generate",
        "comparison", "checks", "load_cases", "sizing", "viewer", "sweeps", "report",
    },
}  # fmt: skip
"""Lower rooms first.  Of rooms side by side: load_cases know neither checks nor viewer; sizing reads what load_cases write; viewer and
sweeps don't know each other; a report shows results of sizing and pictures of the viewer."""

ARRAYS = {"ksl.spatial", "ksl.ufuncs"}
"""Public modules of the root beside the rooms: algebra on arrays."""


def room(module: str) -> str:
    """The room that a module is in; the longest name of a package that is one."""
    if module in FACES:
        return TOP
    if module in ARRAYS:
        return "arrays"
    name = module.removeprefix("ksl.")
    while name not in ALLOWED:
        if name in COMPILED:
            return name
        name, dot, _ = name.rpartition(".")
        assert dot, f"{module} is in no room; add it to ALLOWED"
    return name


GRAPH = {name: found for name, found in imports(PYTHON).items() if name not in ("ksl._core", "ksl._ufuncs")}


def test_the_table_has_no_circle():
    assert list(TopologicalSorter(ALLOWED).static_order())
    seen: set[str] = set()
    for name, below in ALLOWED.items():
        assert below <= seen, f"{name} may import {sorted(below - seen)}, which come later: lower rooms first"
        seen.add(name)


def test_every_room_is_there_and_every_permission_used():
    """A permission that nobody uses is a door left open."""
    used: dict[str, set[str]] = {name: set() for name in ALLOWED}
    for module, found in GRAPH.items():
        if room(module) != TOP:
            used[room(module)] |= {room(other) for other in found} - COMPILED - {room(module), TOP}
    assert used == ALLOWED


@pytest.mark.parametrize("module", sorted(GRAPH))
def test_no_module_imports_a_higher_room(module):
    if (own := room(module)) == TOP:
        return
    for other in GRAPH[module]:
        if other != "ksl":  # `from ksl import _core`, counted below
            assert room(other) in {own, *ALLOWED[own], *COMPILED}, f"{module} ({own}) imports {other} ({room(other)})"


def test_rooms_take_nothing_from_the_root_but_modules():
    """Not `import ksl` and then `ksl.compute_loads`, which would reach every room."""
    for path in sorted((PYTHON / "ksl").rglob("*.py")):
        if module_name(path, PYTHON) in FACES:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                assert "ksl" not in {alias.name for alias in node.names}, f"{path}:{node.lineno}: import ksl"
            if isinstance(node, ast.ImportFrom) and node.module == "ksl":
                for alias in node.names:
                    assert f"ksl.{alias.name}" in GRAPH or alias.name in COMPILED, f"{path}:{node.lineno}: {alias.name} of ksl"


def private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def defined(tree: ast.AST) -> set[str]:
    """Private names that a module defines: functions, classes, variables, attributes of objects."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.add(node.attr)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
    return {name for name in names if private(name)}


def private_uses(trees: dict[str, ast.AST]) -> list[str]:
    """Where a module uses `x._name`, x not being self or cls, or imports `_name`, and only modules of other rooms define that name."""
    names: dict[str, set[str]] = {}
    for module, tree in trees.items():
        names.setdefault(room(module), set()).update(defined(tree))
    others = set().union(*names.values())
    found = []
    for module, tree in trees.items():
        foreign = others - names[room(module)]
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and private(node.attr) and node.attr in foreign:
                if not (isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")):
                    found.append(f"{module}:{node.lineno}: {ast.unparse(node)}")
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("ksl") and node.module != "ksl":
                found += [f"{module}:{node.lineno}: {alias.name} of {node.module}" for alias in node.names if alias.name in foreign]
    return found


def trees() -> dict[str, ast.AST]:
    return {module_name(path, PYTHON): ast.parse(path.read_text(encoding="utf-8")) for path in sorted((PYTHON / "ksl").rglob("*.py"))}


def test_no_room_uses_private_names_of_another():
    assert private_uses(trees()) == []


@pytest.mark.parametrize(
    "use", ["def f(model):\n    return model._joint_index", "from ksl.model.model import _rebuilt", "class A:\n    def f(self):\n        return self.model._core"]
)
def test_a_private_use_is_found(use):
    given = {**trees(), "ksl.report.planted": ast.parse(use)}
    assert [line for line in private_uses(given) if line.startswith("ksl.report.planted")]
