"""What `cmake --install` lays down serves C and C++ users, through find_package and through pkg-config, wherever it is; and
KSL as a part of another project (add_subdirectory) asks for no more than that project has."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("KSL_LIBRARY", ROOT / "build/clang/libksl.so")).parent

C = """
#include <ksl/engine.h>
#include <ksl/ksl.h>
#include <stdio.h>
int main(int argc, char **argv) {
  ksl_model_t *m;
  if (argc != 2 || ksl_model_load(argv[1], NULL, &m) != KSL_OK) { fprintf(stderr, "%s\\n", ksl_error_message()); return 1; }
  printf("%d joints\\n", ksl_model_moving_joints(m));
  ksl_model_free(m);
  return 0;
}
"""
CPP = """
#include <ksl/batch.hpp>
#include <ksl/spatial.hpp>
#include <cstdio>
int main(int, char **argv) {
  try {
    ksl::model m = ksl::load(argv[1]);
    ksl::data d(m);
    std::vector<double> q(m.nq()), tau(m.nv());
    ksl::gravity_torque(m, d, q.data(), tau.data());
    std::printf("%d joints\\n", m.moving_joints());
    ksl::load("no such file");
  } catch (const ksl::description_error &e) {
    return 0;
  }
  return 1;
}
"""

ALGEBRA = """
#include <ksl/ksl.h>
#include <math.h>
#if defined(__cplusplus) && __cplusplus != 201703L
#error not the standard that the project asks for
#endif
int main(int argc, char **argv) {
  ksl_vec3_t v = ksl_vec3(1, 2, 2);
  ksl_vec3_print(stdout, &v, argc > 5 ? argv[0] : "v = ");
  printf("%g\\n", ksl_vec3_l2norm(&v) + cos(argc > 5));
  return 0;
}
"""
ALGEBRA_PRINTS = "v = [1, 2, 2]\n4\n"


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    first, moved = tmp_path_factory.mktemp("first") / "p", tmp_path_factory.mktemp("second") / "moved"
    subprocess.run(["cmake", "--install", BUILD, "--prefix", first], check=True, capture_output=True)
    shutil.move(first, moved)
    return moved


def run(program, library_dir, examples):
    done = subprocess.run([program, examples / "robots/ur5.urdf"], capture_output=True, text=True, env=os.environ | {"LD_LIBRARY_PATH": str(library_dir)})
    assert (done.returncode, done.stdout) == (0, "6 joints\n"), done.stderr


needs_pkg_config = pytest.mark.skipif(shutil.which("pkg-config") is None, reason="pkg-config is not installed")


def pkg_config(prefix, *arguments):
    folder = next(prefix.rglob("*.pc")).parent
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", *arguments], check=True, capture_output=True, text=True, env=os.environ | {"PKG_CONFIG_PATH": str(folder)}
    )
    return flags.stdout.split()


def shared_libraries(program):
    return re.findall(r"\(NEEDED\).*\[(.*)\]", subprocess.run(["readelf", "-d", program], check=True, capture_output=True, text=True).stdout)


PROGRAMS = pytest.mark.parametrize(("compiler", "name", "text"), [("gcc", "a.c", C), ("g++ -std=c++20", "a.cpp", CPP)])


@needs_pkg_config
@PROGRAMS
def test_pkg_config(prefix, tmp_path, examples, compiler, name, text):
    """By the shared library; beside it, as docs/start/embedded.md says it, libksl.a in a program; and a program that is static throughout."""
    (tmp_path / name).write_text(text)
    (library,) = prefix.rglob("libksl.so")
    ways = {"shared": pkg_config(prefix, "ksl"), "static": pkg_config(prefix, "ksl-static"), "wholly": ["-static", *pkg_config(prefix, "--static", "ksl")]}
    of_compiler = {way: [flag for flag in flags if flag.startswith(("-I", "-D"))] for way, flags in ways.items()}
    for way, flags in ways.items():
        if way == "shared" or of_compiler[way] != of_compiler["shared"]:
            subprocess.run([*compiler.split(), "-c", tmp_path / name, "-o", tmp_path / "a.o", *of_compiler[way]], check=True)
        subprocess.run([*compiler.split(), tmp_path / "a.o", "-o", tmp_path / "a", *flags], check=True)
        found = shared_libraries(tmp_path / "a")
        assert not found if way == "wholly" else found and any("libksl.so" in library for library in found) == (way == "shared"), way
        run(tmp_path / "a", library.parent if way == "shared" else tmp_path, examples)


@needs_pkg_config
@pytest.mark.parametrize("compiler", ["gcc -std=c11 -x c", "clang -std=c11 -x c", "g++ -std=c++17 -x c++", "clang++ -std=c++17 -x c++"])
@pytest.mark.parametrize("form", ["shared", "static"])
def test_pkg_config_of_the_algebra(prefix, form, compiler, tmp_path):
    flags = pkg_config(prefix, "ksl-algebra" if form == "shared" else "ksl-algebra-static")
    (tmp_path / "a").write_text(ALGEBRA)
    subprocess.run([*compiler.split(), tmp_path / "a", "-x", "none", "-o", tmp_path / "program", *flags], check=True)
    (library,) = prefix.rglob("libksl_algebra.so")
    printed(tmp_path / "program", library.parent if form == "shared" else tmp_path, ALGEBRA_PRINTS)


def configured(folder, languages, lines, *options):
    """A project of a user's in a folder, configured."""
    project = f"cmake_minimum_required(VERSION 3.22)\nproject(user {languages})\n"
    (folder / "CMakeLists.txt").write_text(project + "\n".join(lines) + "\n")
    for name, text in (("c.c", C), ("cpp.cpp", CPP), ("algebra.c", ALGEBRA), ("algebra.cpp", ALGEBRA)):
        (folder / name).write_text(text)
    quick = ["-DCMAKE_C_FLAGS_RELEASE=-O0", "-DCMAKE_CXX_FLAGS_RELEASE=-O0"]  # an optimised library takes 9 s
    return subprocess.run(["cmake", "-S", folder, "-B", folder / "build", *quick, *options], capture_output=True, text=True)


def built(folder, languages, lines, *options, targets=()):
    """The folder that its programs are built in."""
    done = configured(folder, languages, lines, *options)
    assert done.returncode == 0, done.stdout + done.stderr
    done = subprocess.run(["cmake", "--build", folder / "build", *(["--target", *targets] if targets else [])], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "build"


def program(name, source, *libraries):
    return f"add_executable({name} {source})\ntarget_link_libraries({name} {' '.join(libraries)})"


FIND = "find_package(ksl CONFIG REQUIRED)"


def test_find_package(prefix, tmp_path, examples):
    lines = [FIND] + [program(f"{name}{form}", f"{name}.{name}", f"ksl::ksl{form}") for name in ("c", "cpp") for form in ("", "_static")]
    lines += [
        program("wholly", "$<TARGET_OBJECTS:cpp_static>", "ksl::ksl_static"),
        "set_target_properties(wholly PROPERTIES LINKER_LANGUAGE CXX LINK_OPTIONS -static)",
    ]
    build = built(tmp_path, "C CXX", lines, f"-DCMAKE_PREFIX_PATH={prefix}")
    for name in ("c", "cpp", "c_static", "cpp_static", "wholly"):
        run(build / name, tmp_path, examples)
    assert not shared_libraries(build / "wholly") and not any(
        "ksl" in library for name in ("c_static", "cpp_static") for library in shared_libraries(build / name)
    )


def test_find_package_in_a_project_in_c(prefix, tmp_path, examples):
    """The engine is C++, its shared library serves C programs; the algebra is C in both forms."""
    lines = [FIND, program("engine", "c.c", "ksl::ksl"), program("shared", "algebra.c", "ksl::algebra"), program("static", "algebra.c", "ksl::algebra_static")]
    build = built(tmp_path, "C", lines, f"-DCMAKE_PREFIX_PATH={prefix}")
    run(build / "engine", tmp_path, examples)
    for name in ("shared", "static"):
        printed(build / name, tmp_path, ALGEBRA_PRINTS)


def test_find_package_leaves_cpp17_as_it_is(prefix, tmp_path):
    lines = ["set(CMAKE_CXX_STANDARD 17)", "set(CMAKE_CXX_EXTENSIONS OFF)", FIND]
    lines += [program("shared", "algebra.cpp", "ksl::algebra"), program("static", "algebra.cpp", "ksl::algebra_static")]
    build = built(tmp_path, "CXX", lines, f"-DCMAKE_PREFIX_PATH={prefix}")
    for name in ("shared", "static"):
        printed(build / name, tmp_path, ALGEBRA_PRINTS)


def test_components_are_targets(prefix, tmp_path):
    options = f"-DCMAKE_PREFIX_PATH={prefix}"
    lines = ["find_package(ksl CONFIG REQUIRED COMPONENTS algebra algebra_static compat ksl ksl_static)"]
    done = configured(tmp_path, "C CXX", lines, options)
    assert done.returncode == 0, done.stderr
    done = configured(tmp_path, "C CXX", lines, options, "-DCMAKE_DISABLE_FIND_PACKAGE_pugixml=ON")
    assert done.returncode != 0 and "ksl::ksl_static is not there" in " ".join(done.stderr.split())
    done = configured(
        tmp_path, "C CXX", [FIND, "if(TARGET ksl::ksl_static)\nmessage(FATAL_ERROR static)\nendif()"], options, "-DCMAKE_DISABLE_FIND_PACKAGE_pugixml=ON"
    )
    assert done.returncode == 0, "who links the shared library needs no pugixml: " + done.stderr


PART = f"add_subdirectory({ROOT} ksl EXCLUDE_FROM_ALL)"


def exists(target, wanted):
    return f"if({'NOT ' if wanted else ''}TARGET {target})\nmessage(FATAL_ERROR {target})\nendif()"


def test_part_of_a_project_in_c(tmp_path):
    """No C++ compiler is asked for, nothing of C++ is built, and the project's settings stay."""
    lines = [
        PART,
        program("shared", "algebra.c", "ksl::algebra"),
        program("static", "algebra.c", "ksl::algebra_static"),
        program("bare", "algebra.c", "ksl::compat"),
        exists("ksl::ksl", False),
        'if(CMAKE_BUILD_TYPE OR CMAKE_C_STANDARD)\nmessage(FATAL_ERROR "the settings were changed")\nendif()',
    ]
    build = built(tmp_path, "C", lines, "-DCMAKE_CXX_COMPILER=none")
    for name in ("shared", "static", "bare"):
        printed(build / name, tmp_path, ALGEBRA_PRINTS)
    assert "CMAKE_BUILD_TYPE:STRING=\n" in (build / "CMakeCache.txt").read_text()


def test_part_of_a_project_in_cpp17(tmp_path):
    """The engine is there, but the algebra is linked without it and leaves the standard alone."""
    lines = ["set(CMAKE_CXX_STANDARD 17)", "set(CMAKE_CXX_EXTENSIONS OFF)", PART, program("app", "algebra.cpp", "ksl::algebra")]
    lines += [exists(f"ksl::{target}", True) for target in ("ksl", "ksl_static", "algebra", "algebra_static", "compat")]
    printed(built(tmp_path, "CXX", lines, targets=["app"]) / "app", tmp_path, ALGEBRA_PRINTS)


def test_fetched_by_a_project(tmp_path):
    """FetchContent, as a user's project fetches a release; here from this tree."""
    lines = [
        "include(FetchContent)",
        f"FetchContent_Declare(ksl SOURCE_DIR {ROOT})",
        "FetchContent_MakeAvailable(ksl)",
        program("app", "algebra.c", "ksl::algebra"),
    ]
    printed(built(tmp_path, "C", lines, "-DCMAKE_CXX_COMPILER=none", targets=["app"]) / "app", tmp_path, ALGEBRA_PRINTS)


def test_part_of_a_project_without_pugixml(tmp_path):
    lines = [PART, exists("ksl::algebra", True), exists("ksl::ksl", False)]
    done = configured(tmp_path, "CXX", lines, "-DCMAKE_DISABLE_FIND_PACKAGE_pugixml=ON")
    assert done.returncode == 0, done.stderr


def test_the_engine_in_a_project_in_c(tmp_path):
    """Where it is asked for; CMake refused this for want of a C++ compiler's features."""
    done = configured(tmp_path, "C", ["set(KSL_ENGINE ON)", PART, program("app", "c.c", "ksl::ksl")])
    assert done.returncode == 0, done.stderr


def test_without_the_engine(tmp_path):
    """Built and installed by itself: the algebra, and nothing that mentions the engine."""
    build, prefix = tmp_path / "build", tmp_path / "p"
    options = ["-DKSL_ENGINE=OFF", "-DCMAKE_CXX_COMPILER=none", "-DCMAKE_C_FLAGS_RELEASE=-O0"]
    for command in (["cmake", "-S", ROOT, "-B", build, *options], ["cmake", "--build", build], ["cmake", "--install", build, "--prefix", prefix]):
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    assert {p.name for p in prefix.rglob("*") if p.suffix in (".a", ".so", ".pc")} == {
        "libksl_algebra.a",
        "libksl_algebra.so",
        "ksl-algebra.pc",
        "ksl-algebra-static.pc",
    }
    headers = {p.relative_to(prefix / "include/ksl").as_posix() for p in (prefix / "include/ksl").rglob("*") if p.is_file()}
    assert not [name for name in headers if name.startswith(("engine", "dynamics", "model", "batch")) or name in ("arrays.h", "builder.hpp", "dual.hpp")]
    assert {"ksl.h", "spatial.hpp", "detail/vec3.inc", "compat/coscrew.h"} <= headers
    user = tmp_path / "user"
    user.mkdir()
    printed(built(user, "C", [FIND, program("app", "algebra.c", "ksl::algebra")], f"-DCMAKE_PREFIX_PATH={prefix}") / "app", user, ALGEBRA_PRINTS)
    done = subprocess.run(["cmake", "-S", ROOT, "-B", build, *options, "-DKSL_TESTS=ON"], capture_output=True, text=True)
    assert done.returncode != 0 and "-DKSL_ENGINE=ON" in done.stderr


PUBLISHED = ROOT / "test/contract/published_program.c"
PRINTED = PUBLISHED.with_suffix(".txt").read_text()


def printed(program, library_dir, expected=PRINTED):
    done = subprocess.run([program], capture_output=True, text=True, env=os.environ | {"LD_LIBRARY_PATH": str(library_dir)})
    assert (done.returncode, done.stdout) == (0, expected), done.stderr


def test_a_published_program_by_the_installed_compat_directory(prefix, tmp_path):
    """<coscrew.h> from the installed tree alone, by plain -I and by the target ksl::compat."""
    (library,) = prefix.rglob("libksl.so")
    include = prefix / "include"
    subprocess.run(
        [
            "gcc",
            "-std=gnu11",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-DBARE",
            "-I",
            include / "ksl/compat",
            "-I",
            include,
            PUBLISHED,
            library,
            "-lm",
            "-o",
            tmp_path / "plain",
        ],
        check=True,
    )
    printed(tmp_path / "plain", library.parent)
    lines = ["set(CMAKE_C_STANDARD 11)", FIND, program("bare", PUBLISHED, "ksl::compat"), "target_compile_definitions(bare PRIVATE BARE)"]
    printed(built(tmp_path, "C", lines, f"-DCMAKE_PREFIX_PATH={prefix}") / "bare", library.parent)
