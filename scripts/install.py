#!/usr/bin/env python3
"""pip install, saying what it does and how far it is:  scripts/install.py [ARGUMENTS OF pip install…]

Everything that pip, CMake and the compiler say goes to build/install.log, whose end is shown if the installation fails."""

import re
import subprocess
import sys
import time
from pathlib import Path

LOG = Path("build/install.log")
COMPILED = re.compile(r"\[(\d+)/(\d+)\] Building")
STAGES = {"Building wheel": "configuring the build", "Installing collected packages": "installing Python packages"}
SHOWN = 40  # lines of the log after a failure


def main() -> int:
    LOG.parent.mkdir(exist_ok=True)
    start, last, said = time.monotonic(), -1, set()
    tell = lambda text: print(f"  {time.monotonic() - start:4.0f} s  {text}", flush=True)
    tell("looking for the Python packages that KSL needs")
    pip = subprocess.Popen([sys.executable, "-m", "pip", "install", "-v", *sys.argv[1:]], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    with LOG.open("w") as log:
        for line in pip.stdout:
            log.write(line)
            log.flush()
            if found := COMPILED.search(line):
                done, units = map(int, found.groups())
                if (tenth := 10 * done // units) != last:
                    tell(f"compiling: {done} of {units}")
                    last = tenth
            for words, stage in STAGES.items():
                if words in line and stage not in said:
                    said.add(stage)
                    tell(stage)
    if pip.wait():
        print("".join(LOG.read_text().splitlines(keepends=True)[-SHOWN:]), file=sys.stderr)
        print(f"the installation failed; all of its output is in {LOG}", file=sys.stderr)
    return pip.returncode


if __name__ == "__main__":
    sys.exit(main())
