#!/usr/bin/env python3
"""Runs several shell commands at the same time, and shows what each has written in one block.

    scripts/side_by_side.py NAME=COMMAND…

The first one's output is shown as it comes, that of the others when it and they have ended.  The last lines say how each ended, with its time
and processor time.  The status is 1 if one failed."""

import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor


def run(name, command, output):
    """(name, status, seconds, seconds of processor time)."""
    start = time.monotonic()
    process = subprocess.Popen(["sh", "-c", command], stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return name, process.returncode, time.monotonic() - start, used.ru_utime + used.ru_stime


def main(arguments):
    if not arguments or not all("=" in argument for argument in arguments):
        sys.exit(__doc__)
    commands = [argument.split("=", 1) for argument in arguments]
    print(f"==== {commands[0][0]}, and beside it {', '.join(name for name, _ in commands[1:])}", flush=True)
    with ThreadPoolExecutor(len(commands)) as pool:
        files = [None, *(tempfile.TemporaryFile() for _ in commands[1:])]
        runs = [pool.submit(run, name, command, file) for (name, command), file in zip(commands, files, strict=True)]
        ended = [runs[0].result()]
        for (name, command), file, other in zip(commands[1:], files[1:], runs[1:], strict=True):
            ended.append(other.result())
            print(f"==== {name}: {command}", flush=True)
            file.seek(0)
            sys.stdout.buffer.write(file.read())
            sys.stdout.flush()
    print("====")
    for name, status, seconds, used in ended:
        print(f"{name}: {'ok' if status == 0 else f'FAILED with status {status}'}, {seconds:.0f} s, {used:.0f} s of processor time")
    sys.exit(any(status for _, status, _, _ in ended))


if __name__ == "__main__":
    main(sys.argv[1:])
