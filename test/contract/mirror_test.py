"""Folders of tests mirror those of the product: who changes a room finds its tests by its name."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ELSEWHERE = {
    "python/ksl/commands": "test/cli"  # by command lines, as users call them, and through all rooms
}
"""Rooms whose tests are in a folder with another name, or that the tests of a room beside them hold."""


def rooms():
    python = [p for p in (ROOT / "python/ksl").iterdir() if p.is_dir() and any(p.glob("*.py"))]
    compiled = [p for top in ("src", "src/engine") for p in (ROOT / top).iterdir() if p.is_dir() and any(p.rglob("*.cpp"))]
    return sorted(p.relative_to(ROOT).as_posix() for p in (*python, *compiled))


def test_each_room_has_tests_of_its_name():
    found = rooms()
    assert len(found) > 20
    for room in found:
        tests = ROOT / ELSEWHERE.get(room, room.replace("python/ksl", "test").replace("src", "test", 1))
        assert any(f.suffix in (".py", ".cpp", ".c") and "_test" in f.stem for f in tests.rglob("*") if f.is_file()), (
            f"{room}: no tests in {tests.relative_to(ROOT)}"
        )
    assert set(ELSEWHERE) <= set(found)
