"""A program of the published library's compiles and runs unchanged: headers by either kind of name, and the one-file header."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "include"
COMPAT = INCLUDE / "ksl" / "compat"
HERE = Path(__file__).parent
sys.path.insert(0, str(ROOT / "test" / "algebra"))
sys.path.insert(0, str(ROOT / "scripts"))
from functions import published
from library import find
from single_header import flatten

PUBLISHED_HEADERS = {"SE3", "array", "axis", "coscrew", "eulerangles", "inertia", "ksl", "linalg", "mat3x3", "mat4x4", "matrix", "memory", "print",
                     "quaternion", "screw", "trig", "vec3", "vec4", "version"}


def test_every_published_header_has_its_bare_name():
    assert {h.stem for h in COMPAT.iterdir()} == PUBLISHED_HEADERS
    assert {Path(f.header).stem for f in published()} <= PUBLISHED_HEADERS


@pytest.mark.parametrize("compiler", ["gcc -std=c11 -x c", "clang -std=c11 -x c", "g++ -std=c++20 -x c++", "clang++ -std=c++20 -x c++"])
def test_bare_headers_alone(compiler, tmp_path):
    files = []
    for header in sorted(PUBLISHED_HEADERS):
        files.append(tmp_path / f"{header}.source")
        sequence = "enum { sequence = (int)ZYX };\n" if header in ("axis", "mat3x3", "ksl", "quaternion") else ""
        files[-1].write_text(f"#include <{header}.h>\n{sequence}int {header}_included;\n")
    done = subprocess.run([*compiler.split(), "-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-I", COMPAT, "-I", INCLUDE,
                           *files], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_version_is_the_projects(tmp_path):
    """<ksl/version.h> and <version.h> tell it, and it is that of CMakeLists.txt."""
    (version,) = re.findall(r"project\(ksl VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())
    for header, include in (("ksl/version.h", []), ("version.h", ["-I", COMPAT])):
        text = f"#include <{header}>\nKSL_VERSION KSL_VERSION_MAJOR.KSL_VERSION_MINOR.KSL_VERSION_PATCH\n"
        done = subprocess.run(["gcc", "-E", "-P", *include, "-I", INCLUDE, "-x", "c", "-"], input=text, capture_output=True, text=True, check=True)
        assert "".join(done.stdout.split()) == f'"{version}"{version}'


def test_the_system_headers_stay_themselves(tmp_path):
    """<memory.h> is the C library's also: who means that one gets it too."""
    (tmp_path / "a.c").write_text("#include <memory.h>\nvoid *f(void *a, const void *b) { return memcpy(a, b, 3); }\n")
    for include in ([], ["-I", COMPAT, "-I", INCLUDE]):
        subprocess.run(["gcc", "-std=c11", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", *include, tmp_path / "a.c"], check=True)


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("style", ["ksl/coscrew.h", "coscrew.h", "single header"])
def test_a_published_program_runs_unchanged(style, compiler, tmp_path):
    library = find()
    options = {
        "ksl/coscrew.h": ["-I", INCLUDE, "-DKSL_SHORT_AXIS_NAMES"],
        "coscrew.h": ["-I", COMPAT, "-I", INCLUDE, "-DBARE"],
        "single header": ["-I", tmp_path, "-DKSL_SHORT_AXIS_NAMES", "-DKSL_IMPLEMENTATION"],
    }[style]
    if style == "single header":
        (tmp_path / "ksl").mkdir()
        (tmp_path / "ksl" / "ksl.h").write_text(flatten())
        (tmp_path / "ksl" / "trig.h").touch()
        (tmp_path / "ksl" / "memory.h").touch()
        linked = []
    else:
        linked = [library, f"-Wl,-rpath,{library.parent}"]
    subprocess.run([compiler, "-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", *options, HERE / "published_program.c", *linked, "-lm", "-o",
                    tmp_path / "program"], check=True)
    done = subprocess.run([tmp_path / "program"], capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout == (HERE / "published_program.txt").read_text()


@pytest.mark.parametrize("compiler", ["gcc -std=c11 -x c", "clang -std=c11 -x c", "g++ -std=c++20 -x c++", "clang++ -std=c++20 -x c++"])
@pytest.mark.parametrize("ndebug", [[], ["-DNDEBUG"]], ids=["debug", "ndebug"])
def test_published_types_and_macros(compiler, ndebug):
    flags = ["-fsyntax-only", "-Wall", "-Wextra", "-Wno-invalid-offsetof", "-Werror", "-DKSL_SHORT_AXIS_NAMES", "-I", INCLUDE, *ndebug]
    done = subprocess.run([*compiler.split(), *flags, HERE / "published_types.c"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
