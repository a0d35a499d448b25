"""No circle of modules in python/ksl, whatever the imports look like: at the top, inside functions, for annotations alone."""

import ast
import re
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from syntax import PYTHON, nodes


def module_name(path: Path, folder: Path) -> str:
    parts = path.relative_to(folder).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_names(path: Path, folder: Path) -> set[str]:
    """Dotted names that a file imports, anywhere in it; `from a import b` may mean a.b or a name in a."""
    name = module_name(path, folder)
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = set()
    for node in nodes(path) if PYTHON in path.parents else ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            levels = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            start = ".".join([*levels, *([node.module] if node.module else [])])
            found |= {f"{start}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Call) and "import" in getattr(node.func, "attr", getattr(node.func, "id", "")):
            found |= {a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str)}
    return found


@cache
def imports_of_ksl() -> dict[str, set[str]]:
    return imports(PYTHON)


def imports(folder: Path) -> dict[str, set[str]]:
    """{module: modules of the package that it imports}.  That a package runs before its modules do isn't counted."""
    files = {module_name(path, folder): path for path in folder.rglob("*.py")}
    graph = {name: imported_names(path, folder) for name, path in files.items()}
    extension = "ksl._core"
    sources = [path.read_text(encoding="utf-8") for pattern in ("*.cpp", "*.hpp") for path in folder.glob(pattern)]
    if sources:
        graph[extension] = {name for text in sources for name in re.findall(r'import_\("([\w.]+)"', text)}

    def module(name: str) -> str | None:
        """The module that a name is, or lies in."""
        while name and name not in graph:
            name = name.rpartition(".")[0]
        return name or None

    return {name: {m for m in map(module, names) if m and m != name} for name, names in graph.items()}


def circle(graph: dict[str, set[str]]) -> list[str] | None:
    """One circle of modules, each imported by the next."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return None


def test_no_circle_of_modules():
    graph = imports_of_ksl()
    assert {"ksl", "ksl._core", "ksl.model.model", "ksl.spatial", "ksl.commands.app"} <= graph.keys()
    found = circle(graph)
    assert found is None, "a circle of modules: " + " is imported by ".join(found)


@pytest.mark.parametrize(
    "back",
    [
        "from package.a import f",
        "from package import a",
        "import package.a",
        "from . import a",
        "from .a import f",
        "def g():\n    from package import a",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from package.a import f",
        'import importlib\na = importlib.import_module("package.a")',
        "from package import f",  # by way of the package, which takes it from a
    ],
)
def test_a_circle_is_found(tmp_path, back):
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").write_text("from package.a import f\n")
    (package / "a.py").write_text("from package.b import g\n\ndef f():\n    pass\n")
    (package / "b.py").write_text("def g():\n    pass\n")
    assert circle(imports(tmp_path)) is None
    (package / "b.py").write_text(back + "\n")
    assert {"package.a", "package.b"} <= set(circle(imports(tmp_path)))
