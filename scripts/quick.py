#!/usr/bin/env python3
"""After a change of one algorithm: compiles its kernel, links the library and the module, and runs the tests that name it.

    scripts/quick.py NAME…    names of algorithms, as in api/algorithms/, or of headers of the engine, without .hpp
    scripts/quick.py          builds all of build/quick, as the first run of the other form does
    scripts/quick.py --configure    builds nothing: build/quick/compile_commands.json for editors

It runs the tests of C++ in test/engine and the laws in test/laws whose text has the name as a word.  Of the kernels it compiles those of the names
alone: others that include a changed header stay as they are until all is built.  `make test` is what counts.  Uses cmake --preset quick: clang, one
instruction set, -O1, each kernel by itself, and ccache where it is."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build/quick"
PACKAGE = BUILD / "package"
BIN = Path(sys.executable).parent
NINJA = str(BIN / "ninja") if (BIN / "ninja").exists() else "ninja"
JOBS = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or str(os.cpu_count())


def configure():
    nanobind = subprocess.check_output([sys.executable, "-m", "nanobind", "--cmake_dir"], text=True).strip()
    launcher = shutil.which("ccache")
    options = [f"-DCMAKE_{language}_COMPILER_LAUNCHER={launcher}" for language in ("C", "CXX") if launcher]
    python = [f"-D{name}_EXECUTABLE={sys.executable}" for name in ("Python", "Python3")]
    command = ["cmake", "--preset", "quick", f"-DCMAKE_MAKE_PROGRAM={shutil.which(NINJA)}", f"-Dnanobind_DIR={nanobind}", *options, *python]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def ninja(*arguments, **options):
    return subprocess.run([NINJA, "-C", str(BUILD), *arguments], check=True, text=True, **options)


def outputs():
    """All files that the build makes."""
    said = ninja("-t", "targets", "all", capture_output=True).stdout
    return [line.split(": ")[0] for line in said.splitlines() if ": " in line]


def last_command(target):
    """The words of the command that makes it from what is there."""
    return ninja("-t", "commands", "-s", target, capture_output=True).stdout.strip()


def named(folder, pattern, names):
    """The files of a folder whose text has one of the names as a word."""
    word = re.compile(rf"\b({'|'.join(map(re.escape, names))})\b")
    return [path for path in sorted((ROOT / folder).glob(pattern)) if word.search(path.read_text(encoding="utf-8"))]


def run_in_build(command):
    done = subprocess.run(command, shell=True, cwd=BUILD)
    if done.returncode:
        sys.exit(done.returncode)


def link_tests(objects):
    """A program of some of engine_test's files, linked by its command."""
    kept = {"allocation.cpp.o", "cmake_pch.hxx.pch.o", *(Path(name).name for name in objects)}
    words = last_command("test/engine/engine_test").replace("&& :", "").replace(": &&", "").strip()
    left = [word for word in shlex.split(words) if not ("engine_test.dir" in word and word.endswith(".o") and Path(word).name not in kept)]
    left[left.index("-o") + 1] = "test/engine/quick_test"
    run_in_build(shlex.join(left))


def stage():
    """The package beside its new module, without copying it."""
    package = PACKAGE / "ksl"
    shutil.rmtree(package, ignore_errors=True)
    package.mkdir(parents=True)
    for path in [*(ROOT / "python/ksl").iterdir(), *(BUILD / "python").glob("_core*.so")]:
        if path.name != "__pycache__" and not (path.parent.name == "ksl" and path.name.startswith("_core.")):
            (package / path.name).symlink_to(path)


def main(names):
    complete = BUILD / ".complete"  # all has been built once
    if not (BUILD / "build.ninja").exists() or names == ["--configure"]:
        configure()
    if names == ["--configure"]:
        return 0
    if not names or not complete.exists():
        ninja("-j", JOBS)
        complete.touch()
        if not names:
            return 0
    made = outputs()
    kernels = [path for path in made if path.endswith(".o") and Path(path).name.removesuffix(".cpp.o") in names and "algorithms" in path]
    sources = named("test/engine", "*_test.cpp", names)
    objects = [path for path in made for source in sources if path.endswith(f"engine_test.dir/{source.name}.o")]
    laws = named("test/laws", "*_test.py", names)
    if not objects and not laws:
        sys.exit(f"no test in test/engine or test/laws names {', '.join(names)}")
    ninja("-j", JOBS, "--quiet", *kernels, *objects)
    module = next(path for path in made if re.search(r"python/_core\.[^/]*so$", path))
    for target in (next(p for p in made if re.fullmatch(r"libksl\.so\.\d+\.\d+\.\d+", p)), "libksl.a", module) if kernels else ():
        run_in_build(last_command(target))
    status = 0
    if objects:
        link_tests(objects)
        filters = ",".join(f"*/{source.name}" for source in sources)
        status |= subprocess.run([BUILD / "test/engine/quick_test", f"--source-file={filters}"]).returncode
    if laws:
        stage()
        environment = os.environ | {"PYTHONPATH": str(PACKAGE), "KSL_LIBRARY": str(BUILD / "libksl.so")}
        status |= subprocess.run([sys.executable, "-m", "pytest", "-n", JOBS, *laws], cwd=ROOT, env=environment).returncode
    return int(status != 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
