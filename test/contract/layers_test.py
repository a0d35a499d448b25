"""A lower layer never includes a higher one, no unit is in a circle, and kernels bring no code of the standard library along."""

import functools
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
INCLUDE, SRC = ROOT / "include", ROOT / "src"

ENGINE = ("kernels", "states", "model", "mimic", "elements", "loops", "compiled", "building", "run")
DESCRIPTION = ("parts", "structure", "making")
SIMULATION = ("system", "methods", "runs")
IN = lambda folder, rooms: tuple(f"{folder}/{room}" for room in rooms)
ROOMS = ("text", *IN("description", DESCRIPTION), "load", *IN("engine", ENGINE), "generate", "batch", *IN("simulate", SIMULATION), "c_api")

LAYERS = [
    ("bodies and types", r"include/ksl/(detail/.*|config\.h|types\.h)"),
    ("C algebra", r"include/ksl/(compat/|(?!engine(_\w+)?\.h))[^/]*\.h"),
    ("template algebra", r"include/ksl/(isa|algebra|pack|spatial)\.hpp"),
    *((f"engine: {room}", rf"include/ksl/engine/{room}/.*\.hpp") for room in ("lanes", "model", "steps", "algorithms")),
    ("engine: old paths of headers", r"include/ksl/engine/[^/]*\.hpp"),
    ("owning model, dispatched calls, C ABI", r"include/ksl/([^/]*\.hpp|engine(_\w+)?\.h)"),
    ("symbols of the algebra", r"src/[^/]*"),
    *((f"library: {room}", rf"src/{room}/.*") for room in ROOMS),
    ("Python module", r"python/.*"),
]
"""Lowest first; a file belongs to the first pattern that fits."""

STRANGERS = [("engine", "load"), ("batch", "load")]
"""Folders of src/ that know nothing of a lower one: models are made from descriptions, wherever these come from."""

C_HEADERS = {"math.h", "stdarg.h", "float.h", "stdbool.h", "stddef.h", "stdint.h", "string.h", "stdlib.h", "stdio.h", "assert.h"}
NO_CODE_OF_THEIR_OWN = {
    "cfloat",
    "concepts",
    "cstddef",
    "cstdint",
    "cstring",
    "float.h",
    "math.h",
    "stdbool.h",
    "stddef.h",
    "stdint.h",
    "string.h",
    "emmintrin.h",
    "immintrin.h",
}


def layer(path: Path) -> int:
    name = path.relative_to(ROOT).as_posix()
    for rank, (_, pattern) in enumerate(LAYERS):
        if re.fullmatch(pattern, name):
            return rank
    raise AssertionError(f"{name} is in no layer; add it to LAYERS")


def sources() -> list[Path]:
    folders = [(INCLUDE / "ksl", "**/*"), (SRC, "**/*"), (ROOT / "python", "*.cpp")]
    return sorted(f for folder, pattern in folders for f in folder.glob(pattern) if f.suffix in (".h", ".hpp", ".inc", ".c", ".cpp"))


@functools.cache
def includes(path: Path) -> tuple[list[Path], list[str]]:
    """Files of the project and headers of others that a file includes."""
    own, foreign = [], []
    for name in re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', path.read_text(encoding="utf-8"), re.MULTILINE):
        found = [p for p in (path.parent / name, INCLUDE / name, SRC / name) if p.is_file()]
        (own.append(found[0].resolve()) if found else foreign.append(name))
    return own, foreign


def closure(path: Path) -> set[Path]:
    seen, pending = set(), [path]
    while pending:
        file = pending.pop()
        if file not in seen:
            seen.add(file)
            pending += includes(file)[0]
    return seen


def test_there_is_something_in_every_layer():
    assert {layer(f) for f in sources()} == set(range(len(LAYERS)))


def test_no_file_includes_a_higher_layer():
    higher = [f"{path.relative_to(ROOT)} ({LAYERS[layer(path)][0]}) includes {other.relative_to(ROOT)} ({LAYERS[layer(other)][0]})"
              for path in sources() for other in includes(path)[0] if layer(other) > layer(path)]  # fmt: skip
    assert not higher


def test_no_unit_is_in_a_circle():
    """A unit is a header with its source, wherever in the two an include stands."""
    edges: dict[Path, set[Path]] = {}
    for path in sources():
        unit = path.with_suffix("")
        edges.setdefault(unit, set()).update(other.with_suffix("") for other in includes(path)[0] if other.with_suffix("") != unit)
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        raise AssertionError(" includes ".join(unit.relative_to(ROOT).as_posix() for unit in reversed(error.args[1]))) from None


@pytest.mark.parametrize("folder, other", STRANGERS)
def test_these_folders_dont_know_each_other(folder, other):
    seen = [f"{f.name}: {g.name}" for f in sources() if SRC / folder in f.parents for g in includes(f)[0] if SRC / other in g.parents]
    assert not seen, f"src/{folder} includes headers of src/{other}: {seen}"


def test_an_old_path_leads_to_the_header_that_is_there_no_more():
    for path in (INCLUDE / "ksl/engine").glob("*.hpp"):
        (new,) = includes(path)[0]
        assert new.name == path.name and len(path.read_text(encoding="utf-8").splitlines()) == 2


def test_each_header_that_programs_include_is_in_one_room():
    """The folder is flat, as the published library's; its README says what belongs together."""
    page = (INCLUDE / "ksl/README.md").read_text(encoding="utf-8").replace("all of it but `trig.h` and `memory.h`", "")
    named = re.findall(r"`(\w+\.hp?p?)`", page)
    assert sorted(named) == sorted(path.name for path in (INCLUDE / "ksl").iterdir() if path.suffix in (".h", ".hpp"))


def test_the_algebra_needs_c_headers_only():
    strangers = {path.relative_to(ROOT): unknown for path in sources() if layer(path) < 2 and (unknown := set(includes(path)[1]) - C_HEADERS)}
    assert not strangers, "the C algebra depends on nothing but C"


KERNELS = [
    "engine/kernels/finite.cpp",
    "engine/kernels/inverse_kinematics_kernels.cpp",
    "engine/kernels/array_kernels.cpp",
    *(f.relative_to(SRC).as_posix() for folder in ("algorithms/*", "compiled_once") for f in sorted((SRC / "engine/kernels").glob(f"{folder}/*.cpp"))),
]


def test_kernels_include_nothing_that_has_code_of_its_own():
    """Inline functions of the standard library would be shared, weakly, between objects of different instruction sets."""
    for source in KERNELS:
        files = closure(SRC / source)
        assert INCLUDE / "ksl" / "algebra.hpp" in files
        for file in files:
            strangers = set(includes(file)[1]) - NO_CODE_OF_THEIR_OWN
            assert not strangers, f"{file.relative_to(ROOT)} includes {sorted(strangers)}, and {source} includes it"


def test_a_header_may_be_included_twice():
    """Those in compat/ are one line, which includes one of these (compat_test.py)."""
    for path in (f for f in sources() if f.suffix in (".h", ".hpp") and f.parent.name != "compat"):
        text = path.read_text(encoding="utf-8")
        if path.name == "names.h":
            assert "included" in text or "inclusion" in text, "names.h is included many times, and says so"
        else:
            assert "#pragma once" in text or re.search(r"#ifndef (KSL_\w+)\n#define \1\b", text), f"{path} has no include guard"


def test_the_stub_of_the_ufuncs_names_what_the_module_has():
    import numpy as np

    from ksl import _ufuncs

    stub = set(re.findall(r"^(?:def )?(\w+)[:(]", (ROOT / "python/ksl/_ufuncs.pyi").read_text(), re.M))
    assert stub == {name for name in dir(_ufuncs) if not name.startswith("_")}
    assert {name for name in stub if isinstance(getattr(_ufuncs, name), np.ufunc)} == stub - {"set_threads"}
