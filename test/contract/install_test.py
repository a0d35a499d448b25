"""What `cmake --install` lays down serves C and C++ users, through find_package and through pkg-config, wherever it is."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("KSL_LIBRARY", ROOT / "build/gcc/libksl.so")).parent

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


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    first, moved = tmp_path_factory.mktemp("first") / "p", tmp_path_factory.mktemp("second") / "moved"
    subprocess.run(["cmake", "--install", BUILD, "--prefix", first], check=True, capture_output=True)
    shutil.move(first, moved)
    return moved


def run(program, library_dir, examples):
    done = subprocess.run([program, examples / "robots/ur5.urdf"], capture_output=True, text=True, env=os.environ | {"LD_LIBRARY_PATH": str(library_dir)})
    assert (done.returncode, done.stdout) == (0, "6 joints\n"), done.stderr


@pytest.mark.skipif(shutil.which("pkg-config") is None, reason="pkg-config is not installed")
@pytest.mark.parametrize(("compiler", "name", "text"), [("gcc", "a.c", C), ("g++ -std=c++20", "a.cpp", CPP)])
def test_pkg_config(prefix, tmp_path, examples, compiler, name, text):
    (pc,) = prefix.rglob("ksl.pc")
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "ksl"], check=True, capture_output=True, text=True, env=os.environ | {"PKG_CONFIG_PATH": str(pc.parent)})
    (tmp_path / name).write_text(text)
    subprocess.run([*compiler.split(), tmp_path / name, "-o", tmp_path / "a", *flags.stdout.split(), "-lm"], check=True)
    run(tmp_path / "a", pc.parent.parent, examples)


def test_find_package(prefix, tmp_path, examples):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.22)\nproject(user C CXX)\nfind_package(ksl CONFIG REQUIRED)\n"
        "add_executable(c a.c)\ntarget_link_libraries(c ksl::ksl)\nadd_executable(cpp a.cpp)\ntarget_link_libraries(cpp ksl::ksl)\n"
    )
    (tmp_path / "a.c").write_text(C)
    (tmp_path / "a.cpp").write_text(CPP)
    configure = ["cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={prefix}"]
    for command in (configure, ["cmake", "--build", tmp_path / "build"]):
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    for program in ("c", "cpp"):
        run(tmp_path / "build" / program, tmp_path, examples)


PUBLISHED = ROOT / "test/contract/published_program.c"
PRINTED = PUBLISHED.with_suffix(".txt").read_text()


def printed(program, library_dir):
    done = subprocess.run([program], capture_output=True, text=True, env=os.environ | {"LD_LIBRARY_PATH": str(library_dir)})
    assert (done.returncode, done.stdout) == (0, PRINTED), done.stderr


def test_a_published_program_by_the_installed_compat_directory(prefix, tmp_path):
    """<coscrew.h> from the installed tree alone, by plain -I and by the target ksl::compat."""
    (library,) = prefix.rglob("libksl.so")
    include = prefix / "include"
    subprocess.run(["gcc", "-std=gnu11", "-Wall", "-Wextra", "-Werror", "-DBARE", "-I", include / "ksl/compat", "-I", include, PUBLISHED, library, "-lm", "-o",
                    tmp_path / "plain"], check=True)
    printed(tmp_path / "plain", library.parent)
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.22)\nproject(user C)\nset(CMAKE_C_STANDARD 11)\nfind_package(ksl CONFIG REQUIRED)\n"
        f"add_executable(bare {PUBLISHED})\ntarget_compile_definitions(bare PRIVATE BARE)\ntarget_link_libraries(bare ksl::ksl ksl::compat m)\n"
    )
    for command in (["cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={prefix}"], ["cmake", "--build", tmp_path / "build"]):
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    printed(tmp_path / "build" / "bare", library.parent)
