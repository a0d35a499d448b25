#!/usr/bin/env python3
"""Compare the binary interface of the C library with that of the last release, and with the version number.

    scripts/abi/abi.py compare [--record]    ends with status 1 if the version or API_CHANGES.md doesn't say what has changed
    scripts/abi/abi.py release               writes api/abi/VERSION/*.abi.xz: what later versions are compared with

The interface is that of the symbols in api/functions.tsv, of what the headers of the engine and of arrays declare, and of their types.  C++ is promised as source: who uses it compiles it again.
Needs abidw and abidiff (Debian: abigail-tools), gcc and pugixml."""

import argparse
import lzma
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/trust"))
import record

RELEASES = ROOT / "api/abi"
NONE, ADDED, BROKEN = "nothing changed", "additions only", "incompatible"
FLAGS = ["-g", "-O0", "-fPIC", "-fvisibility=hidden", "-w"]


def version_of_project():
    return re.search(r'#define KSL_VERSION "(\S+)"', (ROOT / "include/ksl/config.h").read_text(encoding="utf-8"))[1]


def numbers(version):
    return tuple(map(int, version.split(".")))


def unreleased(version):
    return f"## {version} (unreleased)" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def last_release():
    """The newest version whose interface is on record."""
    return max((path.name for path in RELEASES.iterdir()), key=numbers)


def needed(old, change):
    """The least version that may follow `old` with this change: https://semver.org; below 1.0 the minor number breaks."""
    major, minor, patch = numbers(old)
    if change == NONE:
        return old
    if major == 0:
        return f"0.{minor + 1}.0" if change == BROKEN else f"0.{minor}.{patch + 1}"
    return f"{major + 1}.0.0" if change == BROKEN else f"{major}.{minor + 1}.0"


def objections(old, new, change, announced):
    """What is wrong with calling the result version `new`; announced: whether API_CHANGES.md has a section for it."""
    least = needed(old, change)
    if numbers(new) < numbers(least):
        yield f"the C interface differs from {old} ({change}): version {new} must be {least} or above"
    if change == BROKEN and not announced:
        yield f"API_CHANGES.md needs a section {new} that says what breaks, and what users do about it"


# The parts of the C interface.  The types of the engine that users see as names only are no part of it.  abidw leaves them out if it is
# told where the public headers are, but takes no .inc for one: the algebra, which is written in these, has no such types.
PARTS = {"algebra": (["src/ksl.c", "src/print.c"], []), "engine": (["src/c_api/*.cpp"], ["--drop-private-types"])}


def of_algebra():
    """The names in api/functions.tsv that are symbols."""
    rows = [line.split("\t") for line in (ROOT / "api/functions.tsv").read_text(encoding="utf-8").splitlines()[1:]]
    return [name for row in rows if row[5] == "yes" for name in row[1].split(", ")]


def declared():
    """The names of functions that the headers of the engine and of arrays declare."""
    text = "".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "include/ksl").glob("engine*.h")))
    arrays = re.findall(r"KSL_ARRAY_[12]\((\w+), (\w+),", (ROOT / "include/ksl/arrays.h").read_text(encoding="utf-8"))
    names = re.findall(r"\b(ksl_\w+)\s*\(", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL))
    return sorted({*names, *(f"ksl_array_{name}" for twins in arrays for name in twins)})


def build(part, folder, include):
    """A part as a shared library with debug information.  It is never loaded, so kernels may be missing."""
    exported = folder / "exported"
    exported.write_text(f"{{ global: {'; '.join([*of_algebra(), *declared()])}; local: *; }};\n")
    objects = []
    for source in sorted(path for pattern in PARTS[part][0] for path in ROOT.glob(pattern)):
        compiler = ["g++", "-std=c++20"] if source.suffix == ".cpp" else ["gcc", "-std=c11"]
        objects.append(folder / f"{source.stem}.o")
        subprocess.run([*compiler, *FLAGS, f"-I{include}", f"-I{ROOT / 'src'}", "-c", source, "-o", objects[-1]], check=True)
    library = folder / f"libksl_{part}.so"
    subprocess.run(["g++", "-shared", f"-Wl,--version-script={exported}", "-o", library, *objects], check=True)
    return library


def dump(part, folder, include=ROOT / "include"):
    """What abidw says of a part, in a file."""
    out = folder / f"{part}.abi"
    options = ["--headers-dir", include, *PARTS[part][1], "--no-corpus-path", "--no-comp-dir-path", "--no-show-locs"]
    subprocess.run(["abidw", *options, "--out-file", out, build(part, folder, include)], check=True)
    return out


def difference(old, new):
    """(change, report) of two dumps.  abidiff's status is made of bits: 1 and 2 errors, 4 a change, 8 an incompatible one."""
    done = subprocess.run(["abidiff", "--no-show-locs", old, new], capture_output=True, text=True)
    if done.returncode & 3:
        sys.exit(f"abidiff failed:\n{done.stdout}{done.stderr}")
    if not done.returncode:
        return NONE, ""
    summary = re.search(r"Functions changes summary: (\d+) Removed, (\d+) Changed.* (\d+) Added", done.stdout)
    only_added = not done.returncode & 8 and summary is not None and summary[1] == summary[2] == "0"
    return ADDED if only_added else BROKEN, done.stdout


def planted(old, folder):
    """The change that abidiff sees if the two halves of a screw are in the other order: the size stays.  In a folder of its own, or its dump
    would lie where `old` is."""
    folder = folder / "planted"
    include = folder / "include"
    shutil.copytree(ROOT / "include", include)
    header = include / "ksl/detail/types.inc"
    text = header.read_text(encoding="utf-8")
    swapped = text.replace("vec3 lin, ang;", "vec3 ang, lin;", 1)
    if swapped == text:
        sys.exit("the fault to plant doesn't fit types.inc any more")
    header.write_text(swapped, encoding="utf-8")
    return difference(old, dump("algebra", folder, include))[0]


def released(version, part, folder):
    """The dump of a release, unpacked."""
    path = folder / f"{part}-{version}.abi"
    path.write_bytes(lzma.decompress((RELEASES / version / f"{part}.abi.xz").read_bytes()))
    return path


def compare(recorded):
    version, new = last_release(), version_of_project()
    announced = re.search(rf"^## {re.escape(new)}\b", (ROOT / "API_CHANGES.md").read_text(encoding="utf-8"), re.MULTILINE)
    if recorded:
        record.begin("abi", "make abi")
    figures, found, now = [("compared with", version), ("version", new)], [], {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in PARTS:
            now[part] = dump(part, folder)
            change, report = difference(released(version, part, folder), now[part])
            figures.append((f"C interface, {part}", change))
            found += objections(version, new, change, announced)
            print(report, end="")
        fault = planted(now["algebra"], folder)
    outcome = "caught" if fault == BROKEN else f"missed: {fault}"
    if recorded:
        record.write("abi", "make abi", not found and outcome == "caught", figures, [("the halves of a screw in the other order", outcome)])
    print("; ".join(f"{name}: {value}" for name, value in [*figures, ("planted fault", outcome)]))
    sys.exit("\n".join(found) or (0 if outcome == "caught" else "the planted fault was not seen"))


def release():
    version = version_of_project()
    place = RELEASES / version
    if place.exists() and not unreleased(version):
        sys.exit(f"{version} has been released: its interface stays as it is; give the project a new version")
    place.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        for part in PARTS:
            (place / f"{part}.abi.xz").write_bytes(lzma.compress(dump(part, Path(name)).read_bytes(), preset=9))
    print(place)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["compare", "release"])
    parser.add_argument("--record", action="store_true", help="write the record, test/trust/results/abi.json")
    given = parser.parse_args()
    compare(given.record) if given.what == "compare" else release()
