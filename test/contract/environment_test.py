"""What `make demo` and `make test` see of the environment: nothing that changes behaviour, all that package clients need."""

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent

DROPPED = {
    "PYTHONUNBUFFERED": "1", "PYTHONPATH": "/elsewhere", "PYTHONWARNINGS": "ignore", "PYTEST_ADDOPTS": "--lf", "KSL_ISA": "generic",
    "KSL_LIBRARY": "/old.so", "SKBUILD_CMAKE_BUILD_TYPE": "Debug", "CMAKE_BUILD_TYPE": "Debug", "CMAKE_GENERATOR": "Ninja", "CFLAGS": "-ffast-math",
    "CXXFLAGS": "-O0", "LDFLAGS": "-s", "LANG": "de_DE.UTF-8", "LC_ALL": "de_DE.UTF-8", "COLUMNS": "40", "FORCE_COLOR": "1", "NO_COLOR": "1",
}  # fmt: skip
KEPT = {
    "PIP_INDEX_URL": "https://packages.example/simple", "PIP_CERT": "/cert.pem", "UV_INDEX_URL": "https://packages.example", "SSL_CERT_FILE": "/cert.pem",
    "https_proxy": "http://proxy.example:8080", "NO_PROXY": "localhost", "PYTHON": "python3.12", "CC": "clang", "CXX": "clang++",
    "CMAKE_CXX_COMPILER_LAUNCHER": "ccache", "CCACHE_DIR": "/cache", "HOME": "/home/somebody", "PATH": os.environ["PATH"],
}  # fmt: skip


def seen_by_recipes(tmp_path: Path) -> dict[str, str]:
    """The environment of a recipe in the Makefile, of a make that is started by hand and not by `make test`."""
    (tmp_path / "show.mk").write_text("include Makefile\nshow:\n\t@env -0\n")
    done = subprocess.run(["make", "-s", "-f", tmp_path / "show.mk", "show"], cwd=ROOT, env=DROPPED | KEPT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return dict(line.split("=", 1) for line in done.stdout.split("\0") if line)


def test_variables_that_change_behaviour_are_dropped_and_others_stay(tmp_path):
    seen = seen_by_recipes(tmp_path)
    assert not set(DROPPED) & set(seen)
    assert {name: seen.get(name) for name in KEPT} == KEPT


def test_ci_runs_make_and_nothing_else():
    commands = [line for line in (ROOT / ".ci/run").read_text().splitlines() if not line.startswith("#")]
    assert commands == ["set -eu", 'cd "$(dirname "$0")/.."', "command -v make >/dev/null || scripts/system_packages.sh demo", "exec make ci"]
    asked = subprocess.run(
        ["make", "-n", "--no-print-directory", "ci"], cwd=ROOT, env=KEPT | {"MAKEFLAGS": ""}, capture_output=True, text=True, timeout=60
    ).stdout
    assert '"test=make --no-print-directory test-clang test-python"' in asked
    assert all(part in asked for part in ("lint=", " lint-alone", " abi fuzz-short"))


def test_a_first_look_compiles_the_baseline_alone():
    """Where nothing is installed.  What else needs KSL has all of it."""

    def asked(target: str) -> str:
        done = subprocess.run(["make", "-n", "VENV=build/nowhere", target], cwd=ROOT, env=KEPT | {"MAKEFLAGS": ""}, capture_output=True, text=True, timeout=60)
        return done.stdout

    assert "KSL_FIRST_LOOK=ON" in asked("demo") and "install.py" in asked("full")
    assert all("KSL_FIRST_LOOK" not in asked(target) for target in ("full", "bench-build", "test"))


def test_a_part_of_ci_that_fails_is_told_with_its_own_output_in_one_block():
    parts = ["test=echo one; sleep 0.2; echo two", "lint=echo three; sleep 0.1; echo four >&2; exit 3", "abi=true"]
    done = subprocess.run([ROOT / "scripts/side_by_side.py", *parts], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and "one\ntwo\n" in done.stdout and "three\nfour\n" in done.stdout
    assert [line.split(",")[0] for line in done.stdout.splitlines()[-3:]] == ["test: ok", "lint: FAILED with status 3", "abi: ok"]
