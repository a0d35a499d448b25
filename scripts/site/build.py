#!/usr/bin/env python3
"""Build the site of the documentation into build/site, each version in a folder of its own, with a list of the versions for its menu.

scripts/site/build.py [--into FOLDER]     FOLDER may hold other versions, as the published site does: they stay, and are in the menu"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BEGIN = '<!DOCTYPE html><title>KSL</title><meta http-equiv="refresh" content="0; url={0}/index.html"><a href="{0}/index.html">KSL {0}</a>\n'


def numbers(version):
    return [int(n) for n in version.split(".")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--into", type=Path, default=ROOT / "build/site")
    into = parser.parse_args().into.resolve()
    version = re.search(r'#define KSL_VERSION "(.*)"', (ROOT / "include/ksl/config.h").read_text(encoding="utf-8"))[1]
    place = into / version
    shutil.rmtree(place, ignore_errors=True)
    subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", place],
        cwd=ROOT,
        check=True,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )  # of the theme's makers; docs/decisions/0024-packages.md has what follows from it
    versions = sorted((p.name for p in into.iterdir() if re.fullmatch(r"\d+\.\d+\.\d+", p.name)), key=numbers, reverse=True)
    (into / "versions.json").write_text(
        json.dumps([{"version": v, "title": v, "aliases": ["latest"] if v == versions[0] else []} for v in versions]), encoding="utf-8"
    )
    (into / "index.html").write_text(BEGIN.format(versions[0]), encoding="utf-8")
    print(f"open {into / 'index.html'}")


if __name__ == "__main__":
    main()
