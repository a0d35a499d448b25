"""What is compiled, as CMake lists it, with the options that matter to analysers: language, macros, folders of headers, instruction set."""

import json
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import changes
from warning_options import options

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/lint"
COMPILERS = {"gcc": {"c": "gcc", "c++": "g++"}, "clang": {"c": "clang", "c++": "clang++"}}


@dataclass(frozen=True)
class Unit:
    file: Path
    options: tuple[str, ...]
    march: str  # "" where the unit is not for one instruction set
    folder: Path  # of the build

    @property
    def language(self):
        return "c" if self.file.suffix == ".c" else "c++"

    @property
    def is_test(self):
        return ROOT / "test" in self.file.parents or ROOT / "bench" in self.file.parents

    @property
    def is_kernel(self):
        return bool(self.march)

    @property
    def is_group(self):
        """Several files that are compiled together."""
        return "Unity" in self.file.parts

    @property
    def members(self):
        """The files of ours that it stands for: of a group its sources, or else the one."""
        return changes.included(self.file) if self.is_group else frozenset({self.file})

    @property
    def name(self):
        return f"{self.file.stem.removesuffix('_cxx')} {self.march}".strip() if self.is_group else changes.name(self.file)

    @property
    def key(self):
        """A name that the same unit of another build has, too."""
        return (str(self.file.relative_to(self.folder)) if self.is_group else changes.name(self.file)), self.march


def configured():
    """Configure a build of everything, which writes the list of all commands; nothing is compiled.  Each file is read as it stands: without
    precompiled headers, which would hide what it forgets to include."""
    command = [
        "cmake",
        "-S",
        str(ROOT),
        "-B",
        str(BUILD),
        "-DKSL_TESTS=ON",
        "-DKSL_BENCHMARKS=ON",
        "-DKSL_PYTHON=ON",
        "-DCMAKE_C_COMPILER=gcc",
        "-DCMAKE_CXX_COMPILER=g++",
        "-DKSL_INSTRUCTION_SETS=x86_64_v3;x86_64_v4",
        f"-DPython_EXECUTABLE={sys.executable}",
        f"-DPython3_EXECUTABLE={sys.executable}",
        f"-Dnanobind_DIR={subprocess.check_output([sys.executable, '-m', 'nanobind', '--cmake_dir'], text=True).strip()}",
        "-DSKBUILD_PROJECT_NAME=ksl",
        "-DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON",
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", str(BUILD), "--target", "ksl_generated_tests"], check=True, stdout=subprocess.DEVNULL)  # which tests include
    return commands(BUILD)


def commands(folder):
    """(file, words of its command) of a build."""
    for entry in json.loads((folder / "compile_commands.json").read_text(encoding="utf-8")):
        yield Path(entry["file"]), shlex.split(entry["command"])


def is_ours(file):
    """Not what a build makes, but for the files that include the sources of a group."""
    return ROOT in file.parents and file.exists() and "site-packages" not in file.parts and (ROOT / "build" not in file.parents or "Unity" in file.parts)


def march_of(words):
    """Of kernels; benchmarks are compiled for this processor, whichever it is."""
    return next((word for word in reversed(words) if word.startswith("-march=x86-64")), "")


def units():
    """Each file of ours once for each instruction set, without what the build itself makes.  Kernels are groups; other files that are compiled
    together stand alone."""
    found = {}
    for file, words in configured():
        if not is_ours(file):
            continue
        kept = [word for word in words if word.startswith(("-D", "-U", "-std=", "-fvisibility"))]
        for word in words:
            if word.startswith("-I"):
                own = ROOT in Path(word[2:]).parents and "site-packages" not in Path(word[2:]).parts
                kept += [word] if own else ["-isystem", word[2:]]
        at = [i for i, word in enumerate(words) if word == "-isystem"]
        kept += [part for i in at for part in words[i : i + 2]]
        unit = Unit(file, tuple(kept), march_of(words), BUILD)
        alone = [replace(unit, file=member) for member in sorted(unit.members)] if unit.is_group and not unit.is_kernel else [unit]
        for each in alone:
            found.setdefault((each.file, each.march), each)
    return list(found.values())


def compiled(folder):
    """{(key of a unit, family): is it compiled as it stands} of what a build compiles with every warning that it should be free of as an
    error.  What is compiled with a precompiled header, or together with others, may lack an include."""
    found = {}
    for file, words in commands(folder):
        family = "clang" if "clang" in Path(words[0]).name else "gcc"
        unit = Unit(file, (), march_of(words), folder)
        if not (is_ours(file) or unit.is_group) or "-Werror" not in words or not set(options(family, unit.language, unit.is_test)) <= set(words):
            continue
        precompiled = any(re.search(r"cmake_pch", word) for word in words)
        if unit.is_group and not unit.is_kernel:
            found.update({((changes.name(member), ""), family): False for member in unit.members})
        else:
            found[unit.key, family] = not precompiled
    return found


def command(unit, family, *more):
    return [COMPILERS[family][unit.language], *unit.options, *([unit.march] if unit.march else []), *more, str(unit.file)]
