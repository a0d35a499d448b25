"""Motions that are meant to do harm, or that were cut: each is refused by one sentence, in time that is linear in the file."""

import gzip
import io
import os
import re
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import ksl
from ksl import limits
from ksl.errors import MotionError
from ksl.motions.column_map import read_map
from ksl.motions.reading import read_motion
from ksl.motions.recognise import open_table
from ksl.toml_files import toml_of

HEAD = "time,hip,slide\n"
ROWS = "".join(f"{k},{k / 10},{k / 10}\n" for k in range(8))
"""Eight samples: six at least are differentiated."""


def refused(leg, path, **options) -> str:
    with pytest.raises(MotionError) as caught:
        read_motion(leg, path, **options)
    said = str(caught.value)
    assert said.isprintable() and len(said) < 5000, said[:200]
    return said


# time


def test_a_hundred_thousand_names_of_columns(leg, tmp_path):
    """73 s before; ≤ 1 s a megabyte, of which this is one."""
    text = "time," + ",".join(f"hip_{k}" for k in range(100_000)) + "\n" + "0," * 100_000 + "0\n"
    path = tmp_path / "wide.csv"
    path.write_text(text)
    start = time.process_time()
    assert "unknown column 'hip_0'" in refused(leg, path)
    assert time.process_time() - start < 5
    start = time.process_time()
    assert "no column 'hip'" in refused(leg, path, ignore_extra=True)
    assert time.process_time() - start < 5


def test_a_parquet_file_with_a_repeated_name_among_many(tmp_path):
    names = [f"c{k}" for k in range(20_000)] + ["c19999"]
    pq.write_table(pa.table([pa.array([0.0])] * len(names), names=names), tmp_path / "t.parquet")
    start = time.process_time()
    with pytest.raises(MotionError, match="two columns are named 'c19999'"):
        open_table(tmp_path / "t.parquet")
    assert time.process_time() - start < 5


# what is no regular file


def test_a_named_pipe_is_refused_at_once(leg, tmp_path):
    os.mkfifo(tmp_path / "motion.csv")
    code = "import sys, ksl; ksl.read_motion(ksl.load(sys.argv[1]), sys.argv[2])"
    p = subprocess.run([sys.executable, "-c", code, leg.file, tmp_path / "motion.csv"], capture_output=True, text=True, timeout=60)
    assert "is a pipe" in p.stderr and "- < " in p.stderr


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/full", "/dev/urandom"])
def test_devices(leg, device):
    assert "device" in refused(leg, device)
    with pytest.raises(MotionError, match="device"):
        read_map(device)


def test_standard_input_has_a_limit(leg, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_BYTES", 1000)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(open("/dev/zero", "rb")))
    assert refused(leg, "-").startswith("standard input: is larger than")


def test_a_sparse_file(leg, tmp_path):
    with open(tmp_path / "big.csv", "wb") as f:
        f.write((HEAD + ROWS).encode())
        f.truncate(8 << 30)
    assert "is larger than" in refused(leg, tmp_path / "big.csv")


# sizes


@pytest.mark.parametrize("unit", [b"0" * (1 << 20), bytes(1 << 20)], ids=["zeros", "null"])
def test_compressed_bombs(leg, tmp_path, monkeypatch, unit):
    monkeypatch.setattr(limits, "MOTION_BYTES", 1 << 20)
    for pack, name in ((gzip.compress, "gz"), (__import__("bz2").compress, "bz2"), (__import__("lzma").compress, "xz")):
        (tmp_path / name).write_bytes(pack(HEAD.encode() + unit * 4))
        assert "unpacked" in refused(leg, tmp_path / name)


def test_a_bomb_in_an_npz_file(leg, tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_BYTES", 1 << 20)
    np.savez_compressed(tmp_path / "m.npz", time=np.zeros(1 << 18))
    assert "unpacked" in refused(leg, tmp_path / "m.npz")


def test_an_array_that_claims_more_than_there_is(leg, tmp_path):
    """A header of numpy that announces 10¹⁵ numbers."""
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000,), }"
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    with zipfile.ZipFile(tmp_path / "m.npz", "w") as z:
        z.writestr("time.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(80))
    assert "truncated or damaged" in refused(leg, tmp_path / "m.npz")


def test_a_parquet_file_of_more_numbers_than_are_taken(leg, tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 1000)
    pq.write_table(pa.table({n: np.zeros(2000) for n in ("time", "hip", "slide")}), tmp_path / "m.parquet")
    assert "6,000 numbers" in refused(leg, tmp_path / "m.parquet")


def test_a_csv_file_of_more_numbers_than_are_taken(leg, written, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 23)
    assert "24 numbers" in refused(leg, written(HEAD + ROWS))


def test_too_many_columns(leg, written, monkeypatch):
    monkeypatch.setattr(limits, "COLUMNS", 2)
    assert "3 columns; at most 2" in refused(leg, written(HEAD + ROWS))


@pytest.mark.parametrize("length", [5_000, 131_073, 1_000_000])
def test_a_name_of_a_column_that_is_too_long(leg, written, length):
    """131,073: the standard library's reader gives up there with an error of its own."""
    assert f"is {length:,} characters long" in refused(leg, written(f"time,{'x' * length},hip,slide\n0,0,0,0\n"))


def test_a_field_of_a_map_that_is_too_long(tmp_path):
    (tmp_path / "map.csv").write_text(f"from,to\na,{'x' * 200_000}\n")
    with pytest.raises(MotionError, match="line 2|:2:"):
        read_map(tmp_path / "map.csv")


def test_the_limits_of_the_page_are_those_of_the_readers():
    section = (Path(__file__).parents[2] / "docs/motions.md").read_text(encoding="utf-8").split("\n## Limits\n")[1]
    said = re.findall(r"^\| .* \| ([\d,]+)(?: (GiB|MiB))?(?: characters)? \|$", section, re.MULTILINE)
    numbers = [int(number.replace(",", "")) << {"GiB": 30, "MiB": 20, "": 0}[unit] for number, unit in said]
    readers = (limits.MOTION_BYTES, limits.MOTION_NUMBERS, limits.COLUMNS, limits.LINE_BYTES, limits.NAME_LENGTH, limits.TOML_BYTES, limits.TOML_DEPTH)
    assert numbers == [*readers, limits.ROBOT_BYTES, limits.ATTRIBUTES, limits.NAMESPACE_LENGTH]
    assert f"at most {limits.MESSAGE_LENGTH:,} characters" in section


def test_names_in_a_key(tmp_path):
    """As many as the page says, and not one more."""
    path = tmp_path / "map.toml"
    path.write_text("[columns]\n" + ".".join("a" * limits.TOML_DEPTH) + ' = "hip"\n')
    assert [rule.to for rule in read_map(path).rules.values()] == ["hip"]
    path.write_text("[columns]\n" + ".".join("a" * (limits.TOML_DEPTH + 1)) + ' = "hip"\n')
    with pytest.raises(MotionError, match="map.toml:2: a key of more than 32 names"):
        read_map(path)


@pytest.mark.parametrize("before", ["", "[", "[[", "a = {", "a", "a."])
def test_a_line_of_blanks_in_a_toml_file(before):
    """Alone in their line, 16,000 took 6 s."""
    start = time.process_time()
    for blanks in (" ", "\t"):
        with pytest.raises(MotionError, match="is not TOML"):
            toml_of(before + blanks * 16_000 + "?\n", "map.toml", MotionError)
    assert time.process_time() - start < 1


@pytest.mark.parametrize("line", ["{} = 1", "[{}]", "[[{}]]", "\t[[ {} ]]", "[ {}]", "x = {{{} = 1}}", "x = {{y = 1, {} = 1}}"])
def test_long_keys_wherever_they_stand(line):
    """Names with dots between them, and with blanks around these."""
    for dot in (".", " . ", "\t."):
        toml_of(line.format(dot.join("a" * limits.TOML_DEPTH)) + "\n", "map.toml", MotionError)
        with pytest.raises(MotionError, match="map.toml:1: a key of more than 32 names"):
            toml_of(line.format(dot.join("a" * (limits.TOML_DEPTH + 1))) + "\n", "map.toml", MotionError)


# line ends


@pytest.mark.parametrize("end", ["\r", "\r\n", "\n"])
def test_every_line_end(leg, written, end):
    m = read_motion(leg, written((HEAD + ROWS).replace("\n", end)))
    assert m.q.shape == (8, 2) and not m.doubts
    comment = (HEAD + ROWS.replace("\n", "\n# note\n", 1)).replace("\n", end)
    assert read_motion(leg, written(comment)).q.shape == (8, 2)


@pytest.mark.parametrize("end", ["\r", "\r\n"])
def test_maps_with_every_line_end(tmp_path, end):
    (tmp_path / "map.csv").write_bytes(f"from,to{end}a,hip{end}b,slide{end}".encode())
    assert {k: r.to for k, r in read_map(tmp_path / "map.csv").rules.items()} == {"a": "hip", "b": "slide"}
    (tmp_path / "map.toml").write_bytes(f'[columns]{end}a = "hip"{end}'.encode())
    if end == "\r":
        with pytest.raises(MotionError, match="line ends"):
            read_map(tmp_path / "map.toml")
    else:
        assert read_map(tmp_path / "map.toml").rules["a"].to == "hip"


# files that were cut


def test_a_file_that_was_cut_inside_its_last_number(leg, written):
    """The last line lacks its end, which all others have: 0.25 may have been 0.2578."""
    m = read_motion(leg, written((HEAD + ROWS).removesuffix("\n")))
    assert any("last line (9)" in doubt and "cut" in doubt for doubt in m.doubts), m.doubts


@pytest.mark.parametrize("pack", [gzip.compress, lambda data: data], ids=["gzip", "plain"])
def test_a_file_that_ends_with_its_line_is_not_doubted(leg, written, pack):
    assert not read_motion(leg, written(pack((HEAD + ROWS).encode()))).doubts
    assert not read_motion(leg, written(pack((HEAD + ROWS + "\n\n").encode()))).doubts


def test_a_last_line_with_fewer_values_is_refused(leg, written):
    assert "2 values in a table of 3 columns" in refused(leg, written(HEAD + ROWS + "8,0.8"))
    assert "not a number or missing" in refused(leg, written(HEAD + ROWS + "8,0.8,"))


def test_the_doubt_forbids_a_green_verdict(leg, written):
    whole, cut = (ksl.loads(leg, read_motion(leg, written(text))).verdict.reasons for text in (HEAD + ROWS, (HEAD + ROWS)[:-1]))
    assert not any("cut" in r for r in whole) and any("cut" in r for r in cut)


def test_external_wrenches_that_were_cut(leg, written):
    from ksl.motions.reading import read_wrenches

    text = "time,b.fx\n" + "".join(f"{k},{k}\n" for k in range(8))
    assert read_wrenches(leg, written(text), np.arange(8.0))[1] == []
    assert "cut" in read_wrenches(leg, written(text[:-1]), np.arange(8.0))[1][0]


def test_numbers_below_the_smallest_are_zero(leg, written):
    """1e-400, as programs of more digits write; infinities stay refused."""
    m = read_motion(leg, written(HEAD + ROWS.replace("0,0.0,", "0,1e-400,").replace("1,0.1,", "1,-1e-400,")))
    assert m.q[0, 0] == 0 and m.q[1, 0] == 0
    assert "infinite" in refused(leg, written(HEAD + "0,1e400,0\n1,0,0.1\n2,0.2,0.2\n"))


def test_the_column_of_a_bad_value_beside_columns_that_are_left_out(leg, written):
    said = refused(leg, written("time,x,hip,slide\n0,q,0,0\n1,q,1p,1\n"), ignore_extra=True)
    assert "column 'hip' holds '1p'" in said
    assert "column 'slide' holds '1p'" in refused(leg, written("time,x,hip,slide\n0,q,0,0\n1,q,1,1p\n"), ignore_extra=True)


def test_a_separator_that_is_none(leg, written):
    """Excel's first line `sep=X`, with a character that separates nothing."""
    for mark in ("¹", '"', "\\", "a"):
        refused(leg, written(f"sep={mark}\n" + HEAD + ROWS))
    assert read_motion(leg, written("sep=;\n" + (HEAD + ROWS).replace(",", ";"))).q.shape == (8, 2)


# names


def test_names_in_messages_can_be_printed(leg, written):
    for bad in ("\x1b[31mred", "a\u202eb", "a\x9bb", "=HYPERLINK(1)"):
        said = refused(leg, written(f'time,hip,slide,"{bad}"\n0,0,0,0\n'))
        assert "\x1b" not in said and "\u202e" not in said


@pytest.mark.parametrize("name", ["a\0b.csv", "a\udcffb.csv"])
def test_paths_that_no_file_can_have(leg, name):
    assert "can't be read" in refused(leg, name)


def test_blanks_around_a_joint_in_a_motion(tmp_path):
    """A robot whose joint is called ` hip ` takes the column `hip`, as the loader and every reader of columns see it."""
    (tmp_path / "r.urdf").write_text(
        '<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '</link><joint name=" hip " type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
    )
    robot = ksl.load(tmp_path / "r.urdf")
    for column in ("hip", " hip "):
        (tmp_path / "m.csv").write_text(f'time,"{column}"\n' + "".join(f"{k},{k / 10}\n" for k in range(8)))
        assert read_motion(robot, tmp_path / "m.csv").q[2, 0] == 0.2
    np.savez(tmp_path / "m.npz", **{"time": np.arange(8.0), " hip ": np.arange(8) / 10})
    assert read_motion(robot, tmp_path / "m.npz").q[2, 0] == 0.2
