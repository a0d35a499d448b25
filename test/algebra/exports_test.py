"""Every published name is a symbol of the library, with the published types, and no name is forgotten.  Helpers are none."""

import subprocess
import sys
from collections import Counter

import pytest

from functions import INCLUDE, ROOT, bodies, emitted_headers, published

sys.path.insert(0, str(ROOT / "scripts/abi"))
import abi


def exported(path):
    out = subprocess.run(["nm", "-D", "--defined-only", path], check=True, capture_output=True, text=True).stdout
    return {line.split()[2].split("@")[0] for line in out.splitlines() if line.split()[1] == "T"}


@pytest.fixture(params=["libksl.so", "libksl_algebra.so"])
def symbols(ksl, request):
    """What the two libraries export that have the algebra in them."""
    return exported(ksl.path.with_name(request.param))


def test_every_published_function_is_exported(symbols):
    assert [f.name for f in published() if f.name not in symbols] == []


def test_the_list_of_symbols(ksl):
    """The algebra's library exports what api/functions.tsv lists, and nothing else."""
    listed = abi.of_algebra()
    assert len(listed) == len(set(listed)) and exported(ksl.path.with_name("libksl_algebra.so")) == set(listed)


def test_the_list_of_symbols_with_the_engine(ksl):
    """The library exports the algebra and what the headers of engine and arrays declare, and besides them C++ names only."""
    listed = [*abi.of_algebra(), *abi.declared()]
    assert {name for name in exported(ksl.path.with_name("libksl.so")) if not name.startswith("_Z")} == set(listed)
    assert len(listed) == len(set(listed))


def test_every_body_is_exported_but_helpers(symbols):
    helpers = {f.name for f in bodies() if f.helper}
    assert {"ksl_larger_q", "ksl_angle_restf"} <= helpers and helpers & {f.name for f in published()} == set()
    assert [f.name for f in bodies() if (f.name in symbols) == f.helper] == []


def test_topics_are_complete():
    count = Counter(f.header for f in published())
    assert count["screw.h"] == 97
    assert count["coscrew.h"] == 76
    assert count["vec3.h"] == 59
    assert count["matrix.h"] == 82
    assert count["SE3.h"] == 26
    assert count["inertia.h"] == 22
    assert count["mat3x3.h"] == 40
    assert count["vec4.h"] == 24
    assert count["mat4x4.h"] == 20
    assert count["quaternion.h"] == 53
    assert count["axis.h"] == 2
    assert count["trig.h"] == 10
    assert count["linalg.h"] == 33
    assert count["array.h"] == 10
    assert count["memory.h"] == 18
    assert count["print.h"] == 34
    assert len({f.name for f in published()}) == sum(count.values())


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_headers_declare_the_published_types(compiler):
    """A second declaration with the published types must agree with the header's own."""
    lines = ["#include <ksl/ksl.h>", "#include <ksl/memory.h>", "#include <ksl/trig.h>"]
    lines += [f"{f.returns.c()} {f.name}({', '.join(t.c() for t in f.args) or 'void'});" for f in published()]
    run = subprocess.run([compiler, "-std=c11", "-fsyntax-only", f"-I{INCLUDE}", "-x", "c", "-"], input="\n".join(lines) + "\n", capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_address_of_every_published_function(ksl, compiler, tmp_path):
    """Through a pointer of its published type each function is the library's own symbol."""
    lines = ["#define _GNU_SOURCE", "#define KSL_INLINE inline"]  # inline and not static: the symbol is the library's
    lines += [f'#include "{header}"' for header in emitted_headers()]
    lines += [
        "#include <dlfcn.h>",
        "static void *handle;",
        "static void check(const char *name, const void *address) {",
        "  if (dlsym(handle, name) != address) puts(name);",
        "}",
        "int main(void) {",
        "  handle = dlopen(NULL, RTLD_NOW);",
    ]
    for f in published():
        types = ", ".join(t.c() for t in f.args) or "void"
        lines.append(f'  {{ {f.returns.c()} (*const p)({types}) = {f.name}; const void *a; memcpy(&a, &p, sizeof a); check("{f.name}", a); }}')
    (tmp_path / "addresses.c").write_text("\n".join([*lines, "  return 0;", "}", ""]))
    linked = [ksl.path, f"-Wl,-rpath,{ksl.path.parent}", "-ldl", "-o", tmp_path / "addresses"]
    build = [compiler, "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-isystem", INCLUDE, tmp_path / "addresses.c", *linked]
    done = subprocess.run(build, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert subprocess.run([tmp_path / "addresses"], capture_output=True, text=True, check=True).stdout.split() == []
