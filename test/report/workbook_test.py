"""results.xlsx: the same numbers as in the other files, with units; names of joints are no formulas."""

import csv
import sys
import zipfile

import numpy as np
import pyarrow.parquet as pq
import pytest
from ksl_command import run_ksl

import ksl
from ksl.base import workbooks
from ksl.report import workbook

openpyxl = pytest.importorskip("openpyxl")
HOSTILE = '=HYPERLINK("x")'
SWING = f"""<robot name="=A1+1"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0.1 0"/><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{HOSTILE.replace('"', "&quot;")}" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>"""


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    """A run of a joint whose name would be a formula, written as all there is."""
    folder = tmp_path_factory.mktemp("swing")
    (folder / "swing.urdf").write_text(SWING)
    time = np.linspace(0, 1, 21)
    np.savez(folder / "motion.npz", time=time, q=np.sin(3 * time)[:, None])
    done = run_ksl("loads", folder / "swing.urdf", folder / "motion.npz", "-o", folder / "out", "--csv", "--xlsx")
    assert done.returncode == 0 and "results.xlsx" in done.stdout, done.stderr
    return folder


def sheets(path):
    return {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in openpyxl.load_workbook(path).worksheets}


def same(found, expected) -> bool:
    """Texts and empty cells alike, and numbers to 16 digits, which openpyxl writes."""
    numbers = [(a, b) for a, b in zip(found, expected, strict=True) if not isinstance(b, str) and b is not None]
    return [a for a, b in zip(found, expected) if b is None or isinstance(b, str)] == [b for b in expected if b is None or isinstance(b, str)] and all(
        abs(a - b) <= 1e-15 * abs(b) for a, b in numbers
    )


def test_sheets_hold_what_the_other_files_hold(swing):
    book = sheets(swing / "out/results.xlsx")
    assert list(book) == ["Summary", "Wrenches", "About"]
    table = pq.read_table(swing / "out/wrenches.parquet")
    names, units, *rows = book["Wrenches"]
    assert list(names) == table.column_names
    for name, found in zip(names, zip(*rows), strict=True):
        assert same(found, table.column(name).to_pylist()), name
    assert dict(zip(names, units)) | {"fx": "N", "constraint_tz": "N m", "time": "s", "joint": None, "speed": "rad/s or m/s", "power": "W"} == dict(
        zip(names, units)
    )
    with open(swing / "out/summary.csv") as f:
        expected = list(csv.reader(line for line in f if not line.startswith("#")))
    names, units, *rows = book["Summary"]
    assert list(names) == expected[0] and len(rows) == len(expected) - 1
    for row, other in zip(rows, expected[1:]):
        assert same(row[3:], [None if x == "" else float(x) for x in other[3:]])
    assert dict(zip(names, units))["work_negative"] == "J" and dict(zip(names, units))["axial_moment_rms"] == "N m"
    about = dict(row for row in book["About"])
    assert about["robot"] == "=A1+1" and "motion.npz" in str(about) and "rad/s" in about["units"]


def test_names_are_text_and_no_formulas(swing):
    book = openpyxl.load_workbook(swing / "out/results.xlsx")
    cells = [cell for sheet in book.worksheets for row in sheet.iter_rows() for cell in row if isinstance(cell.value, str) and cell.value.startswith("=")]
    assert {cell.value for cell in cells} >= {HOSTILE, "=A1+1"}
    with zipfile.ZipFile(swing / "out/results.xlsx") as archive:
        assert not any(b"<f>" in archive.read(name) for name in archive.namelist() if "worksheets" in name)


def test_every_column_of_numbers_has_a_unit(swing):
    for names, units, *rows in (sheets(swing / "out/results.xlsx")[name] for name in ("Summary", "Wrenches")):
        for name, unit, values in zip(names, units, zip(*rows)):
            assert (unit is not None) == any(isinstance(x, (int, float)) for x in values) or all(x is None for x in values), name


def test_more_rows_than_a_sheet_has(swing, tmp_path, monkeypatch):
    monkeypatch.setattr(workbook, "MOST_ROWS", 30)
    ksl.compute_loads(swing / "swing.urdf", swing / "motion.npz").write(tmp_path / "out", xlsx=True)
    book = sheets(tmp_path / "out/results.xlsx")
    assert book["Wrenches"] == [("42 rows; a sheet has 30. wrenches.parquet has all of them.",)] and len(book["Summary"]) == 4


def test_without_the_package(swing, tmp_path, monkeypatch):
    monkeypatch.setattr(workbooks, "find_spec", lambda name: None)
    run = ksl.compute_loads(swing / "swing.urdf", swing / "motion.npz")
    with pytest.raises(Exception, match=r"pip install 'ksl\[xlsx\]'"):
        run.write(tmp_path / "out", xlsx=True)
    assert not (tmp_path / "out").exists()


def test_an_older_workbook_is_removed(swing, tmp_path):
    run = ksl.compute_loads(swing / "swing.urdf", swing / "motion.npz")
    assert "results.xlsx" in run.write(tmp_path / "out", xlsx=True)
    assert "results.xlsx" not in run.write(tmp_path / "out") and not (tmp_path / "out/results.xlsx").exists()


def test_control_characters_in_names(tmp_path):
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    sheet = book.create_sheet("x")
    sheet.append(workbooks.cells(sheet, ["a\x00b\x1b\u202e", "x" * 40000, 1.5, None]))
    book.save(tmp_path / "x.xlsx")
    (row,) = sheets(tmp_path / "x.xlsx")["x"]
    assert row[0] == "a\\x00b\\x1b\\u202e" and len(row[1]) == 32767 and row[2:] == (1.5,)
    assert "openpyxl" in sys.modules


def test_workbooks_of_sizing_and_of_a_pose(swing, tmp_path):
    (tmp_path / "c.toml").write_text(f'[[component]]\njoints = [{HOSTILE!r}]\nkind = "motor"\nname = "=1+1"\ngear_ratio = 1\npeak_torque = 90\n')
    done = run_ksl("size", swing / "out", tmp_path / "c.toml", "-o", tmp_path / "s", "--xlsx")
    assert done.returncode == 0 and "sizing.xlsx" in done.stdout, done.stderr
    book = sheets(tmp_path / "s/sizing.xlsx")
    assert list(book) == ["Sizing", "Peaks", "About"], done.stdout
    table = pq.read_table(tmp_path / "s/sizing.parquet")
    names, units, *rows = book["Sizing"]
    assert list(names) == table.column_names and len(rows) == len(table) and "=1+1" in rows[0]
    for name, found in zip(names, zip(*rows), strict=True):
        assert same(found, [None if x == "" else x for x in table.column(name).to_pylist()]), name
    names, units, *rows = book["Peaks"]
    assert (
        dict(zip(names, units))["bending_moment"] == "N m"
        and dict(zip(names, units))["time"] == "s"
        and len(rows) == len(pq.read_table(tmp_path / "s/peaks.parquet"))
    )
    assert run_ksl("size", swing / "out", tmp_path / "c.toml", "-o", tmp_path / "s").returncode == 0 and not (tmp_path / "s/sizing.xlsx").exists()
    done = run_ksl("hold", swing / "swing.urdf", "-o", tmp_path / "h", "--xlsx")
    assert done.returncode == 0 and list(sheets(tmp_path / "h/results.xlsx")) == ["Summary", "Wrenches", "About"]
    for command in (("size", swing / "out", tmp_path / "c.toml"), ("hold", swing / "swing.urdf")):
        done = run_ksl(*command, "--xlsx")
        assert done.returncode == 2 and "into a folder; give it by -o DIR" in done.stderr
