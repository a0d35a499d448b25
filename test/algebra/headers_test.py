"""Every header compiles alone, as C11, C++17 and C++20, with gcc and clang, without a warning; those in C++ as C++20."""

import subprocess
import sys

import pytest

from functions import INCLUDE

sys.path.insert(0, str(INCLUDE.parent / "scripts/lint"))
from warning_options import options

LANGUAGES = {"c": ("-std=c11", {"gcc": "gcc", "clang": "clang"}), "c++17": ("-std=c++17", {"gcc": "g++", "clang": "clang++"}),
             "c++": ("-std=c++20", {"gcc": "g++", "clang": "clang++"})}
C_HEADERS = ["SE3", "array", "articulated_inertia", "axis", "config", "coscrew", "eulerangles", "inertia", "joint_space", "ksl", "linalg", "mat3x3", "mat4x4", "matrix", "matrix6", "memory", "plucker", "poinsot", "print", "pub_types", "quaternion",
             "screw", "spatial_inertia", "trig", "types", "vec3", "vec4", "version"]


@pytest.mark.parametrize("family", ["gcc", "clang"])
@pytest.mark.parametrize("language", LANGUAGES)
def test_headers_alone(language, family, tmp_path):
    standard, compilers = LANGUAGES[language]
    headers = [f"{h}.h" for h in C_HEADERS] + (["algebra.hpp", "spatial.hpp"] if language == "c++" else [])
    files = []
    for header in headers:
        path = tmp_path / f"{header.replace('.', '_')}.{'c' if language == 'c' else 'cpp'}"
        path.write_text(f"#include <ksl/{header}>\nint {path.stem}_included;\n")
        files.append(str(path))
    run = subprocess.run([compilers[family], standard, "-fsyntax-only", *options(family, "c" if language == "c" else "c++"), "-Werror", f"-I{INCLUDE}", *files], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_bodies_give_back_the_users_macros():
    """A macro of the user's that has one of the bodies' names is the same after the headers as before."""
    text = "#define real 42\n#define screw 43\n#include <ksl/ksl.h>\n#include <ksl/trig.h>\n_Static_assert(real == 42 && screw == 43, \"\");\n"
    run = subprocess.run(["gcc", "-std=c11", "-fsyntax-only", "-Werror", f"-I{INCLUDE}", "-x", "c", "-"], input=text, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
