"""scripts/dist: how dist.py ends, what it sees in an extension for macOS, which instruction sets try_wheel.py tries, and what the compiler's wrapper does for
musl and macOS.  What is built is tried by `make dist`."""

import hashlib
import importlib.util
import os
import struct
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


@pytest.mark.parametrize(
    ("target", "tag"),
    [
        ("x86_64-linux-gnu.2.17", "manylinux_2_17_x86_64"),
        ("aarch64-linux-musl", "musllinux_1_2"),
        ("x86_64-windows-gnu", "win_amd64"),
        ("aarch64-macos.13.3", "macosx_13_0_arm64"),  # tags of macOS have no minor versions from 11 on
        ("x86_64-macos.10.15", "macosx_10_15_x86_64"),
    ],
)
def test_the_name_of_a_wheel_says_its_system(monkeypatch, target, tag):
    monkeypatch.setitem(sys.modules, "sbom", types.ModuleType("sbom"))
    monkeypatch.setattr(sys, "path", list(sys.path))
    dist = script("dist")
    assert dist.platform_tag(dist.as_tagged(target)) == tag


@pytest.mark.parametrize(("name", "known"), [("ksl/_core.pyd", True), ("ksl/_core.abi3.pyd", False)])
def test_an_extension_that_no_python_of_windows_imports_is_found(monkeypatch, tmp_path, name, known):
    monkeypatch.setitem(sys.modules, "sbom", types.ModuleType("sbom"))
    monkeypatch.setattr(sys, "path", list(sys.path))
    with zipfile.ZipFile(tmp_path / "ksl.whl", "w") as wheel:
        wheel.writestr(name, "")
        wheel.writestr("ksl/view.py", "")
    found = script("dist").unknown_names(tmp_path / "ksl.whl")
    assert found == ([] if known else [f"{name} has a suffix that Python of Windows doesn't know; expected .pyd alone"])


def mach_o_file(processor=0x0100000C, kind=6, minimum=13 << 16, library="/usr/lib/libSystem.B.dylib", names=("_PyList_New", "_PyInit__core"), signed=True):
    """An extension for macOS of the parts that its look reads.  Names but the last are taken from elsewhere."""
    strings = b"".join(name.encode() + b"\0" for name in names)
    at_symbols = 400
    at_strings = at_symbols + 16 * len(names)
    at_signature = 8192  # two pages
    commands = [
        struct.pack("<6I", 0x32, 24, 1, minimum, minimum, 0),
        struct.pack("<6I", 0xC, 24 + 64, 24, 0, 0, 0) + library.encode().ljust(64, b"\0"),
        struct.pack("<6I", 0x2, 24, at_symbols, len(names), at_strings, len(strings)),
    ]
    commands += [struct.pack("<4I", 0x1D, 16, at_signature, 200)] if signed else []
    content = struct.pack("<8I", 0xFEEDFACF, processor, 0, kind, len(commands), sum(map(len, commands)), 0, 0) + b"".join(commands)
    content = content.ljust(at_symbols, b"\0")
    for name in names:
        content += struct.pack("<IBBHQ", strings.index(name.encode() + b"\0"), 0x0F if name == names[-1] else 0x01, 0, 0xFE00, 0)
    content = (content + strings).ljust(at_signature, b"\0")
    hashes = b"".join(hashlib.sha256(page).digest() for page in (content[:4096], content[4096:]))
    directory = struct.pack(">9I4B", 0xFADE0C02, 44 + 64, 0x20400, 2, 44, 0, 0, 2, at_signature, 32, 2, 0, 12).ljust(44, b"\0") + hashes
    return content + (struct.pack(">5I", 0xFADE0CC0, 20 + len(directory), 1, 0, 20) + directory if signed else b"")


@pytest.mark.parametrize(
    ("faults", "says"),
    [
        ({}, None),
        ({"kind": 8}, None),
        ({"minimum": 11 << 16}, None),
        ({"processor": 0x01000007}, "it is not of arm64 alone"),
        ({"kind": 2}, "it is neither a library nor a bundle"),
        ({"minimum": 13 << 16 | 3 << 8}, "it needs macOS [(13, 3)]; its name promises (13, 0)"),
        ({"library": "/usr/lib/libc++.1.dylib"}, "it needs /usr/lib/libc++.1.dylib"),
        ({"names": ("_PyList_New", "_sched_getaffinity", "_PyInit__core")}, "no library that it names has _sched_getaffinity"),
        ({"signed": False}, "it is not signed, not even ad hoc"),
    ],
)
def test_what_a_mac_would_not_load_is_found(faults, says):
    assert script("mach_o").objections(mach_o_file(**faults), "arm64", (13, 0)) == ([says] if says else [])


def test_a_page_that_changed_after_signing_is_found():
    content = bytearray(mach_o_file())
    content[5000] ^= 1
    assert script("mach_o").objections(bytes(content), "arm64", (13, 0)) == ["1 of its 2 pages have changed since it was signed"]


@pytest.mark.parametrize(
    ("machine", "options", "tried"),
    [
        ("x86_64", [], ["x86-64-v2", "x86-64-v3"]),
        ("AMD64", [], ["x86-64-v2", "x86-64-v3"]),
        ("x86_64", ["--sets", "x86_64_v3"], ["x86-64-v3"]),
        ("aarch64", [], []),
    ],
)
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


@pytest.mark.parametrize(
    ("name", "arguments", "passed"),
    [
        ("c++", "-bundle a.o -Wl,@/nanobind/darwin-ld-cpython.sym -o a.so", "-shared a.o -Wl,-undefined,dynamic_lookup -o a.so"),
        ("c++", "-c a.cpp", "-c a.cpp -include {here}/macos_float.h"),
        ("cc", "-c a.c", "-c a.c"),
    ],
)
def test_the_wrapper_takes_what_cmake_and_nanobind_say_for_macos(tmp_path, name, arguments, passed):
    (tmp_path / "zig").write_text('#!/bin/sh\necho "$@"\n', encoding="utf-8")
    (tmp_path / "zig").chmod(0o755)
    env = {"ZIG": str(tmp_path / "zig"), "ZIG_TARGET": "aarch64-macos.13.0", "PATH": os.environ["PATH"]}
    done = subprocess.run([SCRIPTS / "zig" / name, *arguments.split()], env=env, check=True, capture_output=True, text=True)
    assert done.stdout == f"{name} -target aarch64-macos.13.0 -fno-sanitize=undefined {passed.format(here=SCRIPTS / 'zig')}\n"


@pytest.mark.parametrize(
    ("target", "arguments", "renamed"),
    [
        ("x86_64-linux-musl", ["-shared", "a.o", "-o", "a b.so"], "--replace-needed libc.so libc.musl-x86_64.so.1 a b.so\n"),
        ("aarch64-linux-musl", ["-o", "a.so", "-shared", "a.o"], "--replace-needed libc.so libc.musl-aarch64.so.1 a.so\n"),
        ("x86_64-linux-musl", ["a.o", "-o", "program"], ""),
        ("x86_64-linux-musl", ["-c", "a.c", "-o", "a.o"], ""),
        ("x86_64-windows-gnu", ["-shared", "a.o", "-o", "a.dll"], ""),
    ],
)
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


@pytest.mark.parametrize("system", ["windows", "macos"])
def test_ccache_keeps_objects_of_targets_apart(system):
    """It knows nothing of ZIG_TARGET: objects for Arm came out of it in a build for x86-64."""
    text = (SCRIPTS.parents[1] / f"test/{system}/{system}.mk").read_text(encoding="utf-8")
    assert text.count("ZIG_TARGET=") == text.count("CCACHE_NAMESPACE=") == 1
