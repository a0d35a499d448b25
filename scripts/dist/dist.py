#!/usr/bin/env python3
"""Build the wheel twice, in different folders, time zones and languages, and compare the two byte by byte.  Write wheel, source
archive and list of parts (SBOM) to build/dist.  The packages that build it are those of requirements.txt, with their hashes.

    scripts/dist/dist.py [--sets x86_64_v3]     fewer instruction sets take a third of the time; the record says so"""

import argparse
import hashlib
import os
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
    options = [f"-Ccmake.define.{key}={value}" for key, value in {
        "CMAKE_C_FLAGS": f"-ffile-prefix-map={place}=.", "CMAKE_CXX_FLAGS": f"-ffile-prefix-map={place}=.",
        "KSL_INSTRUCTION_SETS": sets or "all"}.items()]
    old = os.umask(settings["umask"])
    try:
        subprocess.run([sys.executable, "-m", "build", "--no-isolation", "--sdist", "--wheel", *options, "--outdir", place / "out", place], env=env, check=True)
    finally:
        os.umask(old)
    (wheel,), (source,) = (place / "out").glob("*.whl"), (place / "out").glob("*.tar.gz")
    return wheel, source


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
    parts = sbom.of_wheel(wheel)
    for file in (wheel, source):
        shutil.copy(file, OUT)
    (OUT / wheel.name.replace(".whl", ".cdx.json")).write_text(parts + "\n", encoding="utf-8")
    figures = [("wheel, SHA-256 of both builds" if not differ else "files that differ", ", ".join(differ) or digest(wheel)),
               ("source archive, SHA-256", digest(source)), ("instruction sets", sets or "all"), ("list of parts", "CycloneDX 1.5, valid by its schema")]
    record.write("supply-chain", "make dist", not differ and caught, figures, [("a file with the time of the build", "caught" if caught else "missed")])
    if differ:
        sys.exit(f"the builds differ: {', '.join(differ)}")
    if not caught:
        sys.exit("the planted fault, a file with the time of the build, was not seen")


if __name__ == "__main__":
    main()
