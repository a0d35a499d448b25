"""scripts/dist: how dist.py ends, which instruction sets try_wheel.py tries, and what the compiler's wrapper does with musl's name.  What is built is tried by `make dist`."""

import importlib.util
import os
import subprocess
import sys
import types
import zipfile
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "scripts/dist"


def script(name):
    spec = importlib.util.spec_from_file_location(f"{name}_script", SCRIPTS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("found", [[], ["it has not the stable ABI", "it needs foreign.dll"]])
def test_a_wheel_for_another_system_is_a_success_without_objections(monkeypatch, tmp_path, found):
    monkeypatch.setitem(sys.modules, "sbom", types.ModuleType("sbom"))  # whose packages are those of `make dist` alone
    monkeypatch.setattr(sys, "path", list(sys.path))
    dist = script("dist")
    wheel = tmp_path / "ksl.whl"
    wheel.write_bytes(b"")
    monkeypatch.setattr(dist, "OUT", tmp_path / "out")
    monkeypatch.setattr(dist, "build", lambda place, *more: (place.mkdir(parents=True), (wheel, wheel))[1])
    monkeypatch.setattr(dist, "objections", lambda *of: found)
    with pytest.raises(SystemExit) as end:
        dist.one_for("aarch64-linux-musl", None)
    assert end.value.code == ("\n".join(found) or 0)


@pytest.mark.parametrize(("name", "known"), [("ksl/_core.pyd", True), ("ksl/_core.abi3.pyd", False)])
def test_an_extension_that_no_python_of_windows_imports_is_found(monkeypatch, tmp_path, name, known):
    monkeypatch.setitem(sys.modules, "sbom", types.ModuleType("sbom"))
    monkeypatch.setattr(sys, "path", list(sys.path))
    with zipfile.ZipFile(tmp_path / "ksl.whl", "w") as wheel:
        wheel.writestr(name, "")
        wheel.writestr("ksl/view.py", "")
    found = script("dist").unknown_names(tmp_path / "ksl.whl")
    assert found == ([] if known else [f"{name} has a suffix that Python of Windows doesn't know; expected .pyd alone"])


@pytest.mark.parametrize(("machine", "options", "tried"), [
    ("x86_64", [], ["x86-64-v2", "x86-64-v3"]),
    ("AMD64", [], ["x86-64-v2", "x86-64-v3"]),
    ("x86_64", ["--sets", "x86_64_v3"], ["x86-64-v3"]),
    ("aarch64", [], []),
])
def test_the_sets_that_a_wheel_has_are_tried(monkeypatch, examples, machine, options, tried):
    of_wheel, asked = script("try_wheel"), []

    def done(what, command, cwd, env=None):
        asked.extend([env["KSL_ISA"]] if env else [])
        (Path(cwd) / "out").mkdir(exist_ok=True)
        (Path(cwd) / "out/report.html").write_text("<!doctype html>", encoding="utf-8")
        return ""

    monkeypatch.setattr(of_wheel, "timed", done)
    monkeypatch.setattr(of_wheel.platform, "machine", lambda: machine)
    monkeypatch.setattr(sys, "argv", ["try_wheel.py", str(examples), *options])
    of_wheel.main()
    assert asked == tried


@pytest.mark.parametrize(("target", "arguments", "renamed"), [
    ("x86_64-linux-musl", ["-shared", "a.o", "-o", "a b.so"], "--replace-needed libc.so libc.musl-x86_64.so.1 a b.so\n"),
    ("aarch64-linux-musl", ["-o", "a.so", "-shared", "a.o"], "--replace-needed libc.so libc.musl-aarch64.so.1 a.so\n"),
    ("x86_64-linux-musl", ["a.o", "-o", "program"], ""),
    ("x86_64-linux-musl", ["-c", "a.c", "-o", "a.o"], ""),
    ("x86_64-windows-gnu", ["-shared", "a.o", "-o", "a.dll"], ""),
])
@pytest.mark.parametrize("fails", [False, True])
def test_a_library_for_musl_needs_it_by_the_name_of_wheels(tmp_path, target, arguments, renamed, fails):
    for name, status in (("zig", int(fails)), ("patchelf", 0)):
        (tmp_path / name).write_text(f'#!/bin/sh\necho "$@" >>"{tmp_path}/{name}.log"\nexit {status}\n', encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    env = {"ZIG": str(tmp_path / "zig"), "ZIG_TARGET": target, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run([SCRIPTS / "zig/c++", *arguments], env=env, check=False)
    assert done.returncode == fails
    assert (tmp_path / "zig.log").read_text(encoding="utf-8").startswith(f"c++ -target {target} ")
    log = tmp_path / "patchelf.log"
    assert (log.read_text(encoding="utf-8") if log.exists() else "") == ("" if fails else renamed)
