"""The syntax of the files in python/ksl, parsed once for all tests that look at it."""

import ast
from functools import cache
from pathlib import Path

PYTHON = Path(__file__).resolve().parents[2] / "python"
FILES = sorted((PYTHON / "ksl").rglob("*.py"))


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes(path: Path) -> list[ast.AST]:
    return list(ast.walk(tree(path)))
