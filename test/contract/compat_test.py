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
sys.path.insert(0, str(ROOT / "scripts" / "abi"))
from abi import version_of_project
from functions import published
from library import find
from single_header import flatten

PUBLISHED_HEADERS = {
    "SE3",
    "array",
    "axis",
    "coscrew",
    "eulerangles",
    "inertia",
    "ksl",
    "linalg",
    "mat3x3",
    "mat4x4",
    "matrix",
    "memory",
    "print",
    "pub_types",
    "quaternion",
    "screw",
    "trig",
    "vec3",
    "vec4",
    "version",
}


def test_every_published_header_has_its_bare_name():
    assert {h.stem for h in COMPAT.iterdir()} == PUBLISHED_HEADERS
    assert {Path(f.header).stem for f in published()} <= PUBLISHED_HEADERS


def test_bare_headers_alone(tmp_path):
    """In C each by itself.  In C++ all of them together: `make lint` reads the header that each names by itself."""
    texts = {header: f"#include <{header}.h>\nint {header}_included;\n" for header in sorted(PUBLISHED_HEADERS)}
    for header, text in texts.items():
        (tmp_path / f"{header}.c").write_text(text)
    (tmp_path / "all.cpp").write_text("".join(texts.values()))
    for compiler, files in (("gcc -std=c11", [tmp_path / f"{header}.c" for header in texts]), ("clang++ -std=c++20", [tmp_path / "all.cpp"])):
        flags = ["-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-I", COMPAT, "-I", INCLUDE]
        done = subprocess.run([*compiler.split(), *flags, *files], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


def test_a_bare_header_is_one_line():
    """All that it gives is in the header that it names."""
    for path in COMPAT.iterdir():
        assert path.read_text().splitlines()[1:] == [f'#include "ksl/{path.name}"']


SEQUENCES = "XYZ YZX ZXY XZY YXZ ZYX XYX XZX YXY YZY ZXZ ZYZ INVALID".split()


@pytest.mark.parametrize("include", ["ksl/{}", "{}"])
def test_sequences_have_their_prefix_alone(include, tmp_path):
    """XYZ, INVALID and their like belong to the program: as names of its own and as macros they are untouched."""
    program = "".join(f"#include <{include.format(h)}.h>\n" for h in sorted(PUBLISHED_HEADERS))
    program += "".join(f"#ifdef {name}\n#error {name}\n#endif\n" for name in SEQUENCES)
    program += (
        f"enum own {{ {', '.join(SEQUENCES)} }};\nint f(void) {{ return {' + '.join('(int)KSL_AXIS_' + n for n in SEQUENCES)} == 78 && INVALID == 12; }}\n"
    )
    (tmp_path / "a.c").write_text(program)
    done = subprocess.run(["gcc", "-std=c11", "-fsyntax-only", "-Werror", "-I", COMPAT, "-I", INCLUDE, tmp_path / "a.c"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


PUBLISHED_TYPES = {
    f"ksl_{t}{f}_t" for t in ("vec3", "vec4", "quaternion", "mat3x3", "mat4x4", "SE3", "screw", "coscrew", "inertia", "eulerangles") for f in ("", "f")
}
PUBLISHED_TYPES |= {"ksl_vec3i_t", "ksl_vec4i_t", "ksl_axis_enum_t", "ksl_print_options_t"}


def test_the_published_program_needs_the_published_library_alone():
    """It calls no function that the published library leaves undeclared or undefined, and no addition of ours."""
    code = re.sub(r"/\*.*?\*/|^#include.*?$", "", (HERE / "published_program.c").read_text(), flags=re.S | re.M)
    functions = {f.name for f in published() if f.linkable}
    macros = {re.sub(r"(WithOptions|WithReference|Option)$", "", name) for name in functions}
    macros |= {name.replace("_print", "_debug") for name in macros}
    constants = {f"KSL_AXIS_{name}" for name in SEQUENCES}
    used = set(re.findall(r"\b(?:ksl_|kls_|KSL_|catan)\w+", code))
    assert len(used) > 80 and used - functions - macros - constants - PUBLISHED_TYPES == set()


def test_the_version_is_the_projects(tmp_path):
    """<ksl/version.h> and <version.h> tell it, in both forms, and it is what the build, the wheel and the packages say."""
    version = version_of_project()
    for header, include in (("ksl/version.h", []), ("version.h", ["-I", COMPAT])):
        text = f"#include <{header}>\nKSL_VERSION KSL_VERSION_MAJOR.KSL_VERSION_MINOR.KSL_VERSION_PATCH\n"
        done = subprocess.run(["gcc", "-E", "-P", *include, "-I", INCLUDE, "-x", "c", "-"], input=text, capture_output=True, text=True, check=True)
        assert "".join(done.stdout.split()) == f'"{version}"{version}'


def test_the_system_headers_stay_themselves(tmp_path):
    """<memory.h> is the C library's also: who means that one gets it too."""
    (tmp_path / "a.c").write_text("#include <memory.h>\nvoid *f(void *a, const void *b) { return memcpy(a, b, 3); }\n")
    for include in ([], ["-I", COMPAT, "-I", INCLUDE]):
        subprocess.run(["gcc", "-std=c11", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", *include, tmp_path / "a.c"], check=True)


def declared(headers):
    """References to all functions of published headers."""
    return "".join(f"  use((void (*)(void)){f.name});\n" for f in published() if Path(f.header).stem in headers)


STANDARD = '  bool said = printf("%d", (int)strlen("")) > 0;\n  (void)said;\n'
MATRIX = "  ksl_matrix_enum_t order = KSL_ROW_MAJOR;\n  (void)order;\n"
TYPES = "".join(f"  (void)sizeof({t});\n" for t in sorted(PUBLISHED_TYPES) if not re.search("euler|print", t))
GIT = '  const char *commit = "" KSL_GIT_COMMIT, *branch = "" KSL_GIT_BRANCH;\n  (void)commit, (void)branch;\n'
ALL = PUBLISHED_HEADERS - {"memory", "trig"}
CONTENTS = {"print": declared(ALL), "ksl": declared(ALL), "pub_types": TYPES + MATRIX, "version": GIT}
CONTENTS |= {h: declared({"vec3"}) for h in ("axis", "eulerangles", "vec4")}
CONTENTS |= {h: declared({"vec3"}) + MATRIX for h in ("SE3", "mat3x3", "mat4x4", "matrix")}
CONTENTS |= {"linalg": MATRIX} | dict.fromkeys(("array", "memory", "trig"), STANDARD)


def test_a_header_gives_what_the_published_one_gives(tmp_path):
    """Programs include one header and use what came along with it."""
    files = [tmp_path / f"{header}.c" for header in CONTENTS]
    for file in files:
        file.write_text(
            f"#include <ksl/{file.stem}.h>\nstatic void use(void (*p)(void)) {{ (void)p; }}\n"
            f"int main(void) {{\n  use(0);\n{CONTENTS[file.stem]}  return 0;\n}}\n"
        )
    done = subprocess.run(["gcc", "-std=c11", "-fsyntax-only", "-Wall", "-Werror", "-I", INCLUDE, *files], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_commit_is_told_by_who_builds():
    """The same text everywhere, unless it is defined: a build from a tarball has the bits of one from a repository."""
    text = "#include <ksl/version.h>\nKSL_GIT_COMMIT KSL_GIT_BRANCH\n"
    for flags, expected in (([], '"unknown" "unknown"'), (['-DKSL_GIT_COMMIT="0123abc"', '-DKSL_GIT_BRANCH="main"'], '"0123abc" "main"')):
        done = subprocess.run(["gcc", "-E", "-P", *flags, "-I", INCLUDE, "-x", "c", "-"], input=text, capture_output=True, text=True, check=True)
        assert done.stdout.split() == expected.split()


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("style", ["ksl/coscrew.h", "coscrew.h", "single header"])
def test_a_published_program_runs_unchanged(style, compiler, tmp_path):
    library = find()
    options = {
        "ksl/coscrew.h": ["-I", INCLUDE],
        "coscrew.h": ["-I", COMPAT, "-I", INCLUDE, "-DBARE"],
        "single header": ["-I", tmp_path, "-DKSL_IMPLEMENTATION"],
    }[style]
    if style == "single header":
        (tmp_path / "ksl").mkdir()
        (tmp_path / "ksl" / "ksl.h").write_text(flatten())
        (tmp_path / "ksl" / "trig.h").touch()
        (tmp_path / "ksl" / "memory.h").touch()
        linked = []
    else:
        linked = [library, f"-Wl,-rpath,{library.parent}"]
    subprocess.run(
        [compiler, "-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", *options, HERE / "published_program.c", *linked, "-lm", "-o", tmp_path / "program"],
        check=True,
    )
    done = subprocess.run([tmp_path / "program"], capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout == (HERE / "published_program.txt").read_text()


@pytest.mark.parametrize("compiler", ["gcc -std=c11 -x c", "clang -std=c11 -x c", "g++ -std=c++20 -x c++", "clang++ -std=c++20 -x c++"])
@pytest.mark.parametrize("ndebug", [[], ["-DNDEBUG"]], ids=["debug", "ndebug"])
def test_published_types_and_macros(compiler, ndebug):
    flags = ["-fsyntax-only", "-Wall", "-Wextra", "-Wno-invalid-offsetof", "-Werror", "-I", INCLUDE, *ndebug]
    done = subprocess.run([*compiler.split(), *flags, HERE / "published_types.c"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
