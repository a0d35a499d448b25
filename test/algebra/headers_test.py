"""Headers compile without a warning as C++17, and as C++20 with gcc.  `make lint` reads each of them alone, as C11 with both compilers and as C++20 with clang."""

import subprocess
import sys

import pytest

from functions import INCLUDE

sys.path.insert(0, str(INCLUDE.parent / "scripts/lint"))
from warning_options import options

STANDARDS = {"c++17": "-std=c++17", "c++": "-std=c++20"}
COMPILERS = {"gcc": "g++", "clang": "clang++"}
C_HEADERS = sorted(path.name for path in (INCLUDE / "ksl").glob("*.h") if not path.name.startswith("engine"))


@pytest.mark.parametrize(("language", "family"), [("c++17", "gcc"), ("c++17", "clang"), ("c++", "gcc")])
def test_headers_in_this_order(language, family, tmp_path):
    headers = C_HEADERS + (["algebra.hpp", "spatial.hpp"] if language == "c++" else [])
    (tmp_path / "all.cpp").write_text("".join(f"#include <ksl/{header}>\n" for header in headers))
    run = subprocess.run(
        [COMPILERS[family], STANDARDS[language], "-fsyntax-only", *options(family, "c++"), "-Werror", f"-I{INCLUDE}", tmp_path / "all.cpp"],
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr


def test_bodies_give_back_the_users_macros():
    """A macro of the user's that has one of the bodies' names is the same after the headers as before."""
    text = '#define real 42\n#define screw 43\n#include <ksl/ksl.h>\n#include <ksl/trig.h>\n_Static_assert(real == 42 && screw == 43, "");\n'
    run = subprocess.run(["gcc", "-std=c11", "-fsyntax-only", "-Werror", f"-I{INCLUDE}", "-x", "c", "-"], input=text, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
