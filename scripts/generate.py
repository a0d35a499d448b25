#!/usr/bin/env python3
"""Write what follows from api/algorithms/: kernels, calls and methods.

    scripts/generate.py            writes the files, removes those of algorithms that are gone
    scripts/generate.py --check    says which files differ from what would be written, and ends with status 1
    scripts/generate.py --tests FOLDER
                                   writes the test of all interfaces, and all algorithms over any scalar; test/engine/CMakeLists.txt calls it

What is written but for tests is checked in; test/contract/generated_test.py compares."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from generator import c_calls, cpp_calls, kernels, python_calls, tests

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = (kernels.KERNELS,)
"""Of generated files only."""


def files() -> dict[str, str]:
    """{path below the project: text}."""
    return {path: text for part in (kernels, cpp_calls, c_calls, python_calls) for path, text in part.files().items()}


def stale() -> list[Path]:
    """Files in generated folders that belong to no row."""
    wanted = {ROOT / path for path in files()}
    return sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.*") if path not in wanted)


def main(argv: list[str]) -> int:
    different = [path for path, text in files().items() if not (ROOT / path).is_file() or (ROOT / path).read_text(encoding="utf-8") != text]
    if argv == ["--check"]:
        for path in [*different, *stale()]:
            print(f"{path} is not what scripts/generate.py makes")
        return 1 if different or stale() else 0
    if argv[:1] == ["--tests"]:
        (folder,) = argv[1:]
        Path(folder).mkdir(parents=True, exist_ok=True)
        for name, text in tests.files().items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        return 0
    for path in different:
        (ROOT / path).parent.mkdir(parents=True, exist_ok=True)
        (ROOT / path).write_text(files()[path], encoding="utf-8")
        print(path)
    for path in stale():
        path.unlink()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
