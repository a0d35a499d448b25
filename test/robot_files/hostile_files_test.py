"""Robot files that are none, and paths that are unusual: refused with a sentence, or loaded."""

import os
import pickle
import re
import subprocess
import sys
import warnings
from pathlib import Path

import ksl
import pytest

ROOT = Path(__file__).parents[2]
ROBOT = "<robot name='r'><link name='a'/></robot>"


def test_what_is_no_regular_file_is_refused_at_once(tmp_path):
    pipe = tmp_path / "pipe.urdf"
    os.mkfifo(pipe)
    # in a process of its own: a reader that waits for the pipe would wait for ever
    program = "import ksl, sys\nfor path in sys.argv[1:]:\n try: ksl.load(path)\n except ksl.DescriptionError as e: print(e)"
    said = subprocess.run([sys.executable, "-c", program, pipe, "/dev/zero", tmp_path], capture_output=True, text=True, timeout=60, check=True).stdout
    assert re.search(
        r"pipe.urdf: this is a pipe, not a regular file; .*ksl.load_string\n/dev/zero: this is a device, .*\n"
        r".*: this is a folder",
        said,
    )


def test_a_path_with_a_zero_byte_is_refused(tmp_path):
    (tmp_path / "a").write_text(ROBOT)
    for path in (f"{tmp_path}/a\0b", os.fsencode(tmp_path / "a") + b"\0b"):
        with pytest.raises(ksl.DescriptionError, match=r"a\\x00b: the path holds a zero byte"):
            ksl.load(path, masses="optional")


def test_a_path_needs_no_utf_8(tmp_path):
    name = os.fsencode(tmp_path) + b"/r\xf6bot\x1b.urdf"
    with open(name, "w") as file:
        file.write(ROBOT)
    for path in (name, os.fsdecode(name)):
        m = ksl.load(path, masses="optional")
        assert os.fsencode(m.file) == name and m.link_names == ["a"]
        assert os.fsencode(pickle.loads(pickle.dumps(m)).file) == name
        framed = pickle.loads(pickle.dumps(m.with_frame("f", "a", [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])))
        assert os.fsencode(framed.file) == name and framed.link_names == ["a", "f"]
    with open(name, "w") as file:
        file.write("<robot>")
    with pytest.raises(ksl.DescriptionError, match=r"r\\xf6bot\\x1b.urdf:1: broken XML"):
        ksl.load(name)
    with pytest.raises(ksl.DescriptionError, match="is no path"):
        ksl.load("\ud800.urdf")  # half a character, which no bytes stand for
    with open(name, "w") as file:
        file.write("<mujoco/>")
    pytest.importorskip("mujoco")
    with pytest.raises(ksl.DescriptionError, match=r"r\\xf6bot\\x1b.urdf: .*MuJoCo reads only paths in UTF-8"):
        ksl.load(name)


def test_messages_from_long_files_are_short():
    name = "x" * 900_000
    for text in (f"<{name}/>", f"<robot><link name='{name}'/></robot>", f"<robot name='r'><link name='a'/><joint name='j' type='{name}'/></robot>", name):
        with pytest.raises(ValueError) as caught:
            ksl.load_string(text)
        assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("before", [b"", b"<?xml version='1.0'?><!--" + b"x" * 1_200_000 + b"-->"])
def test_no_more_than_two_megabytes_are_searched_for_the_root_element(monkeypatch, before):
    """Python's parser takes its input in blocks, and looks at a tag again with each of them: 50 MB took a minute."""
    from ksl.robot_files import loading

    searched, first_element = [], loading._first_element
    monkeypatch.setattr(loading, "_first_element", lambda xml: searched.append(len(xml)) or first_element(xml))
    with pytest.raises(ksl.DescriptionError, match="more than 1 MiB"):
        ksl.load_string(before + b"<robot name='" + b"x" * 20_000_000 + b"'/>")
    assert 0 < sum(searched) <= 2 << 20


def test_the_root_element_is_found_behind_a_long_comment():
    pytest.importorskip("mujoco")
    mjcf = b"<?xml version='1.0'?>\n<!--" + b"x" * 1_200_000 + b"-->\n<mujoco><worldbody/></mujoco>"
    assert ksl.load_string(mjcf, masses="optional").nq == 0


def test_control_characters_in_names_are_said_as_numbers():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        m = ksl.load_string(
            "<robot name='r'><link name='a\u202e\u009b'><z/><inertial><mass value='0'/>"
            "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link></robot>"
        )
    assert m.link_names == ["a\u202e\u009b"] and r"link a\u202e\u009b" in m.unused[0]
    assert any(r"link a\u202e\u009b" in str(each.message) for each in caught)


def test_the_limits_of_the_documentation_are_those_of_the_reader():
    header = (ROOT / "src/text/limits.hpp").read_text()
    limits = {name: eval(value.replace("'", "").replace("u", "")) for name, value in re.findall(r"std::size_t (\w+) = ([^;]+);", header)}
    section = (ROOT / "docs/models.md").read_text().split("### Limits\n")[1].split("\n### ")[0]
    table = dict(re.findall(r"^\| (.+?) \| ([\d,]+(?: MiB)?) \|", section, re.M))
    said = [int(most.removesuffix(" MiB").replace(",", "")) * (2**20 if most.endswith("MiB") else 1) for most in table.values()]
    assert said == list(limits.values()), table
