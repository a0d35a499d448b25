"""The blocks of docs/arrays_that_differentiate.md run, each where its library is."""

import re
import sys
from inspect import signature
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "contract"))
from pages import blocks_of

PAGE = ROOT / "docs" / "arrays_that_differentiate.md"
assert PAGE.name == "arrays_that_differentiate.md"  # which test/contract/readme_test.py looks for


@pytest.mark.parametrize("library", ["jax", "torch"])
def test_block(library, monkeypatch):
    pytest.importorskip(library, reason=f"needs {library}: pip install 'ksl[{library}]'")
    monkeypatch.chdir(ROOT)
    blocks = [b for b in blocks_of(PAGE) if f"import {library}\n" in b.code]
    assert len(blocks) == {"jax": 1, "torch": 2}[library]
    for block in blocks:
        names: dict[str, object] = {}
        exec(compile(block.code, PAGE.name, "exec"), names)
        for line in block.code.splitlines():
            if (found := re.match(r"([\w, ]+) = .*# \(([\d, ]+)\)", line)) is not None:
                shape = tuple(int(n) for n in found[2].split(",") if n.strip())
                assert all(tuple(names[name].shape) == shape for name in found[1].split(", ")), line


@pytest.mark.parametrize("library", ["jax", "torch"])
def test_example_of_the_docstring(library):
    pytest.importorskip(library, reason=f"needs {library}: pip install 'ksl[{library}]'")
    import importlib
    import inspect
    import textwrap

    import numpy as np

    import ksl

    text = inspect.getdoc(importlib.import_module(f"ksl.{library}").differentiable)
    code = textwrap.dedent(text[text.index("    d = ") :])
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, 6))
    names = {"ksl": ksl, library: importlib.import_module(library), "m": ksl.load(ROOT / "examples/robots/ur5.urdf"), "q": q, "v": v, "a": a}
    exec(compile(code, "docstring", "exec"), names)
    for line in code.splitlines():
        if (found := re.match(r"(\w+) = .*# \(([\d, ]+)\)", line)) is not None:
            assert tuple(names[found[1]].shape) == tuple(int(n) for n in found[2].split(",") if n.strip()), line


def test_the_table_of_calls_is_that_of_the_operators():
    from ksl.operators.calls import Calls
    from ksl.operators.table import COMPLETIONS, ROWS

    rows = ROWS | COMPLETIONS
    text = PAGE.read_text(encoding="utf-8").split("## The calls")[1].split("\n\n")[2]
    listed, beside = {}, set()
    for line in text.splitlines()[2:]:
        calls, by, twice, parameters = (cell.strip() for cell in line.strip("|").split("|"))
        names = re.findall(r"`(\w+)`", calls)
        for i, name in enumerate(names):
            own = by.split(";")[min(i, by.count(";"))]
            beside |= {name} if "`external=`" in own else set()
            listed[name] = (
                [x.strip() for x in own.replace(", `external=`", "").split(",")],
                twice == "yes" or (twice == "the first" and i == 0),
                parameters == "yes",
            )
    assert listed == {name: (list(row.inputs), bool(row.second), bool(row.regressor)) for name, row in rows.items()}
    calls = {name: signature(call).parameters for name, call in vars(Calls).items() if not name.startswith("_")}
    assert set(calls) == set(rows) and beside == {name for name, parameters in calls.items() if "external" in parameters}
