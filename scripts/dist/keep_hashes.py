#!/usr/bin/env python3
"""Of the hashes that pip-compile lists, keep those of files that pip takes where KSL is built: CPython 3.11 to 3.14 on Linux with glibc from 2.28 on, on
x86-64 and Arm, and on macOS from 13 on, on Arm.  Elsewhere pip refuses a package whose hash isn't listed.
A package has a line.

    scripts/dist/keep_hashes.py REQUIREMENTS…"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

FEW = 3
"""Hashes of a package of which all are kept: a wheel for any machine, and its source."""
PYTHONS = ["3.11.9", "3.12", "3.13", "3.14"]


def machines() -> list[list[str]]:
    """Tags of machines, the preferred ones first: of two wheels of which one needs a newer system, an older system takes the other."""
    linux = [[f"manylinux_2_{n}_{cpu}" for n in range(newest, 4, -1)] + [f"{name}_{cpu}" for name in ("manylinux2014", "manylinux2010", "manylinux1", "linux")]
             for cpu in ("x86_64", "aarch64") for newest in (28, 36, 39)]  # fmt: skip
    macos = [[f"macosx_{n}_0_{cpu}" for n in range(newest, 10, -1) for cpu in ("arm64", "universal2")] + [f"macosx_10_{n}_universal2" for n in range(16, 8, -1)]
             for newest in (13, 15, 26)]  # fmt: skip
    return linux + macos


def taken(requirements: str, tags: list[str], python: str, folder: str) -> set[str]:
    """Hashes of the files that pip takes there."""
    file, report = Path(folder, "requirements.txt"), Path(folder, "report.json")
    file.write_text(requirements)
    where = [option for tag in tags for option in ("--platform", tag)]
    pip = [sys.executable, *"-m pip install -q --disable-pip-version-check --dry-run --ignore-installed --no-deps --only-binary :all:".split()]
    chosen = [*where, "--python-version", python, "--implementation", "cp", "--require-hashes", "--target", folder, "--report", str(report), "-r", str(file)]
    subprocess.run([*pip, *chosen], check=True)
    return {each["download_info"]["archive_info"]["hashes"]["sha256"] for each in json.loads(report.read_text())["install"]}


def shortened(text: str) -> str:
    packages = re.findall(r"^\S.*\n(?: .*\n)+", text, re.MULTILINE)
    many = "".join(package for package in packages if package.count("--hash") > FEW)
    with tempfile.TemporaryDirectory() as folder:
        kept = set().union(*(taken(many, tags, python, folder) for tags in machines() for python in PYTHONS))
    out = ""
    for package in packages:
        first, *hashes = map(str.strip, package.replace(" \\\n", "\n").splitlines())
        if len(hashes) > FEW:
            hashes = [line for line in hashes if line.split(":")[1] in kept]
        out += " ".join([first, *hashes]) + "\n"
    return out


if __name__ == "__main__":
    for path in map(Path, sys.argv[1:]):
        path.write_text(shortened(path.read_text()))
