"""What is compiled, as CMake lists it, with the options that matter to analysers: language, macros, folders of headers, instruction set."""

import json
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/lint"
COMPILERS = {"gcc": {"c": "gcc", "c++": "g++"}, "clang": {"c": "clang", "c++": "clang++"}}


@dataclass(frozen=True)
class Unit:
    file: Path
    options: tuple[str, ...]
    march: str  # "" where the unit is not for one instruction set

    @property
    def language(self):
        return "c" if self.file.suffix == ".c" else "c++"

    @property
    def is_test(self):
        return ROOT / "test" in self.file.parents or ROOT / "bench" in self.file.parents

    @property
    def is_kernel(self):
        return "Unity" in self.file.parts or bool(self.march)

    @property
    def name(self):
        return str(self.file.relative_to(ROOT)) if "Unity" not in self.file.parts else f"{self.file.stem.removesuffix('_cxx')} {self.march}"


def configured():
    """Configure a build of everything, which writes the list of all commands; nothing is compiled.  Each file is read as it stands: without
    precompiled headers, which would hide what it forgets to include."""
    command = ["cmake", "-S", str(ROOT), "-B", str(BUILD), "-DKSL_TESTS=ON", "-DKSL_BENCHMARKS=ON", "-DKSL_PYTHON=ON", "-DCMAKE_C_COMPILER=gcc", "-DCMAKE_CXX_COMPILER=g++",
               "-DKSL_INSTRUCTION_SETS=x86_64_v3;x86_64_v4", f"-DPython_EXECUTABLE={sys.executable}", f"-DPython3_EXECUTABLE={sys.executable}",
               f"-Dnanobind_DIR={subprocess.check_output([sys.executable, '-m', 'nanobind', '--cmake_dir'], text=True).strip()}",
               "-DSKBUILD_PROJECT_NAME=ksl", "-DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return json.loads((BUILD / "compile_commands.json").read_text())


def units():
    """Each file of ours once for each instruction set, without what the build itself makes."""
    found = {}
    for entry in configured():
        file = Path(entry["file"])
        words = shlex.split(entry["command"])
        if ROOT not in file.parents or not file.exists() or "site-packages" in file.parts:
            continue
        options, march = [], ""
        for word in words:
            if word.startswith("-march="):
                march = word
            elif word.startswith(("-D", "-U", "-std=", "-fvisibility")):
                options.append(word)
            elif word.startswith("-I"):
                folder = Path(word[2:])
                own = ROOT in folder.parents and "site-packages" not in folder.parts
                options += [word] if own else ["-isystem", str(folder)]
        at = [i for i, word in enumerate(words) if word == "-isystem"]
        options += [part for i in at for part in words[i : i + 2]]
        found.setdefault((file, march), Unit(file, tuple(options), march))
    return list(found.values())


def command(unit, family, *more):
    return [COMPILERS[family][unit.language], *unit.options, *([unit.march] if unit.march else []), *more, str(unit.file)]
