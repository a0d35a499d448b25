"""Rooms of python/ksl: none imports a higher one, not even inside functions or for annotations, and none uses private names of another."""

import ast
from collections.abc import Iterable, Mapping
from graphlib import TopologicalSorter

from modules_test import imports_of_ksl, module_name
from syntax import FILES, PYTHON, nodes

COMPILED = {"_core", "_ufuncs"}
TOP = "the public names"
FACES = {"ksl", "ksl.__main__", "ksl.mjcf", "ksl.identification", "ksl.base_parameters", "ksl.consistency", "ksl.jax", "ksl.torch"}
"""Modules of the root that only show what others have, or start the command: they may import every room, and no room imports them."""

ALLOWED: dict[str, set[str]] = {
    # room: the rooms that it may import, beside the compiled modules
    "base": set(),
    "output": set(),
    "arrays": {"base"},
    "mechanism": {"base"},
    "simulation": {"base", "mechanism"},
    "model": {"base", "output", "mechanism", "simulation"},
    "robot_files": {"base", "output", "mechanism", "model"},
    "operators": {"base", "mechanism", "model"},
    "generation": {"base", "output", "mechanism", "model"},
    "drivetrain": {"base", "mechanism", "model", "robot_files", "generation"},
    "identify": {"base", "mechanism", "model"},
    "comparison": {"base", "mechanism", "model", "robot_files"},
    "motions.signal": {"base", "mechanism"},
    "motions.columns": {"base", "mechanism"},
    "motions.files": {"base", "mechanism", "motions.signal", "motions.columns"},
    "motions": {"base", "mechanism", "motions.signal", "motions.columns", "motions.files"},
    "motions.generate": {"base", "output", "mechanism", "model", "identify", "motions", "motions.signal", "motions.columns", "motions.files"},
    "checks.description": {"base", "output", "mechanism", "model", "robot_files"},
    "checks": {"base", "mechanism", "model", "robot_files", "drivetrain", "identify", "checks.description"},
    "load_cases": {"base", "mechanism", "model", "motions.signal", "motions"},
    "load_cases.case_files": {
        "base", "mechanism", "simulation", "model", "robot_files", "motions.signal", "motions.columns", "motions.files", "motions", "load_cases",
    },
    "sizing": {"base", "mechanism"},
    "sizing.catalogue": {"base", "mechanism", "load_cases", "sizing"},
    "sizing.utilisation": {"base", "mechanism", "load_cases", "sizing", "sizing.catalogue"},
    "sizing.choice": {"base", "mechanism", "model", "robot_files", "load_cases", "sizing", "sizing.catalogue", "sizing.utilisation"},
    "sizing.spectra": {"base", "output", "mechanism", "sizing", "sizing.catalogue", "sizing.utilisation"},
    "sizing.joints": {"base", "output", "mechanism", "sizing", "sizing.catalogue", "sizing.utilisation", "sizing.choice"},
    "small_motions": {"base", "output", "mechanism", "model", "robot_files", "motions.signal", "motions", "load_cases", "load_cases.case_files"},
    "parts": {"base", "output", "mechanism", "load_cases", "load_cases.case_files"},
    "viewer": {"base", "output", "mechanism", "model", "robot_files", "motions", "load_cases", "load_cases.case_files"},
    "sweeps": {
        "base", "output", "mechanism", "model", "robot_files", "motions", "load_cases", "load_cases.case_files", "sizing", "sizing.catalogue",
        "sizing.joints",
    },
    "report.html": {"base", "mechanism", "model", "load_cases", "sizing", "sizing.joints", "viewer"},
    "report": {
        "base", "output", "mechanism", "model", "robot_files", "drivetrain", "motions", "load_cases", "load_cases.case_files", "sizing.catalogue",
        "sizing.joints", "viewer", "report.html",
    },
    "commands": {
        "base", "output", "mechanism", "simulation", "model", "robot_files", "generation", "drivetrain", "comparison", "motions.files", "motions",
        "motions.generate", "checks", "load_cases", "load_cases.case_files", "sizing", "sizing.catalogue", "sizing.utilisation", "sizing.choice",
        "sizing.spectra", "sizing.joints", "small_motions", "parts", "viewer", "sweeps", "report.html", "report",
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


def graph() -> dict[str, set[str]]:
    return {name: found for name, found in imports_of_ksl().items() if name not in ("ksl._core", "ksl._ufuncs")}


def test_the_table_has_no_circle():
    assert list(TopologicalSorter(ALLOWED).static_order())
    seen: set[str] = set()
    for name, below in ALLOWED.items():
        assert below <= seen, f"{name} may import {sorted(below - seen)}, which come later: lower rooms first"
        seen.add(name)


def test_every_room_is_there_and_every_permission_used():
    """A permission that nobody uses is a door left open."""
    used: dict[str, set[str]] = {name: set() for name in ALLOWED}
    for module, found in graph().items():
        if room(module) != TOP:
            used[room(module)] |= {room(other) for other in found} - COMPILED - {room(module), TOP}
    assert used == ALLOWED


def test_no_module_imports_a_higher_room():
    found = []
    for module, imported in sorted(graph().items()):
        if (own := room(module)) != TOP:
            allowed = {own, *ALLOWED[own], *COMPILED}
            others = imported - {"ksl"}  # `from ksl import _core`, counted below
            found += [f"{module} ({own}) imports {other} ({room(other)})" for other in sorted(others) if room(other) not in allowed]
    assert not found


def test_rooms_take_nothing_from_the_root_but_modules():
    """Not `import ksl` and then `ksl.compute_loads`, which would reach every room."""
    known = graph()
    for path in FILES:
        if module_name(path, PYTHON) in FACES:
            continue
        for node in nodes(path):
            if isinstance(node, ast.Import):
                assert "ksl" not in {alias.name for alias in node.names}, f"{path}:{node.lineno}: import ksl"
            if isinstance(node, ast.ImportFrom) and node.module == "ksl":
                for alias in node.names:
                    assert f"ksl.{alias.name}" in known or alias.name in COMPILED, f"{path}:{node.lineno}: {alias.name} of ksl"


def private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def defined(nodes: Iterable[ast.AST]) -> set[str]:
    """Private names that a module defines: functions, classes, variables, attributes of objects."""
    names = set()
    for node in nodes:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.add(node.attr)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
    return {name for name in names if private(name)}


def private_uses(modules: Mapping[str, Iterable[ast.AST]]) -> list[str]:
    """Where a module uses `x._name`, x not being self or cls, or imports `_name`, and only modules of other rooms define that name."""
    names: dict[str, set[str]] = {}
    for module, own in modules.items():
        names.setdefault(room(module), set()).update(defined(own))
    others = set().union(*names.values())
    found = []
    for module, own in modules.items():
        foreign = others - names[room(module)]
        for node in own:
            if isinstance(node, ast.Attribute) and private(node.attr) and node.attr in foreign:
                if not (isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")):
                    found.append(f"{module}:{node.lineno}: {ast.unparse(node)}")
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("ksl") and node.module != "ksl":
                found += [f"{module}:{node.lineno}: {alias.name} of {node.module}" for alias in node.names if alias.name in foreign]
    return found


PLANTED = (
    "def f(model):\n    return model._joint_index",
    "from ksl.model.model import _rebuilt",
    "class A:\n    def f(self):\n        return self.model._core",
)


def test_no_room_uses_private_names_of_another():
    """And what is planted is found."""
    modules = {module_name(path, PYTHON): nodes(path) for path in FILES}
    planted = {f"ksl.report.planted_{k}": list(ast.walk(ast.parse(use))) for k, use in enumerate(PLANTED)}
    found = private_uses(modules | planted)
    assert [line.partition(":")[0] for line in found] == list(planted), found
