"""report.pdf: the page as Chromium or Chrome prints it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from ksl.output import OutputError

Paper = Literal["A4", "letter"]

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge", "microsoft-edge")
"""Commands that print a page, in the order in which they are tried."""
OFF_THE_PATH = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
"""Where browsers are that are no commands."""
VARIABLE = "KSL_BROWSER"
"""The environment variable that names another one."""
PATIENCE = 300
"""Seconds after which a browser that has not ended is ended.  A page of 20 joints takes about ten."""


def find_browser() -> str:
    """Path of a browser that prints.  Raises OutputError, which says how to get one."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        found = shutil.which(chosen)
        if found is None:
            raise OutputError(f"{VARIABLE}={chosen}: no such program; give the path of Chromium, Chrome or Edge, or unset it")
        return found
    for name in (*BROWSERS, *OFF_THE_PATH):
        found = shutil.which(name)
        if found is not None:
            return found
    raise OutputError(
        f"a PDF needs Chromium, Chrome or Edge, and none is on the PATH ({', '.join(BROWSERS)}); install one, "
        f"name one in the environment variable {VARIABLE}, or leave out --pdf and print report.html from your browser"
    )


def write_pdf(page: Path, pdf: Path, browser: str, paper: Paper = "A4") -> None:
    """Prints a page of `write_report` to a PDF.  Raises OutputError with what the browser said where it fails.

    The page draws all charts while it loads where its address ends in #print=PAPER.  Images take longer: the time that
    the page sees runs ahead until the budget is used or nothing is left to wait for.
    """
    with TemporaryDirectory(prefix=".browser-", dir=pdf.parent, ignore_cleanup_errors=True) as profile:  # so that a browser that is open isn't asked to print
        options = ["--headless", "--disable-gpu-sandbox", "--no-first-run", "--no-default-browser-check", "--disable-extensions", "--use-angle=swiftshader"]
        options += ["--enable-unsafe-swiftshader", f"--user-data-dir={profile}", "--no-pdf-header-footer", "--virtual-time-budget=60000"]
        if sys.platform.startswith("linux") and os.geteuid() == 0:
            options.append("--no-sandbox")  # Chromium refuses to run as root otherwise; the page is our own and loads nothing
        command = [browser, *options, f"--print-to-pdf={pdf.absolute()}", f"{page.absolute().as_uri()}#print={paper}"]
        try:
            done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=PATIENCE, check=False)
        except subprocess.TimeoutExpired:
            raise OutputError(f"{browser} did not print the report within {PATIENCE} s; leave out --pdf and print report.html from your browser") from None
        except OSError as e:
            raise OutputError(
                f"{browser} can't be run ({os.strerror(e.errno) if e.errno else e}); name another browser in the environment variable {VARIABLE}"
            ) from None
    if done.returncode or not pdf.is_file() or not pdf.stat().st_size:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        last = f": {said[-1]}" if said else ""
        raise OutputError(f"{browser} ended with status {done.returncode} and printed no PDF{last}; leave out --pdf and print report.html from your browser")
