"""A pickle of a model that no file gives has every field of its description: a field that is added is added there, too."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
STATE = (ROOT / "python/description_state.hpp").read_text(encoding="utf-8")


def structs() -> dict[str, set[str]]:
    """{struct: its fields} of description.hpp."""
    text = re.sub(r"//[^\n]*", "", (ROOT / "include/ksl/engine/model/description.hpp").read_text(encoding="utf-8"))
    found = {}
    for name, body in re.findall(r"struct (\w+) \{\n(.*?)\n\};", text, re.S):
        body = re.sub(r"enum \w+ \{[^}]*\}", "enumeration", body)  # a field of a type declared there
        body = re.sub(r"<[^;]*?>(?=\s)|\{[^}]*\}|=[^,;]*", "", body)  # template arguments, initial values
        found[name] = {word for line in body.split(";") for word in re.findall(r"(\w+)\s*(?:,|$)", line.strip())}
    return found


def test_structs_are_found():
    found = structs()
    assert found["joint_description"] >= {"name", "at", "parent", "child", "lower", "upper", "damping", "friction", "given"}
    assert found["given_rotation"] == {"by", "numbers"}
    assert "gravity" in found["robot_description"]


@pytest.mark.parametrize(("name", "fields"), structs().items())
def test_every_field_is_in_the_state(name, fields):
    (written,) = re.findall(rf"void fields\(Go &go, ksl::{name} &\w+\) \{{(.*?)\}}", STATE, re.S)
    assert {f for f in fields if not re.search(rf"\.{f}\b", written)} == set()
