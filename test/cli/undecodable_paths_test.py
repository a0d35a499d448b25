"""Folders and files whose names are not UTF-8: read, written, and named in messages with a number for each such byte."""

import json
import os

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from inputs_kept_test import MOTION, SWEEP, URDF
from ksl_command import run_ksl

ODD = os.fsdecode(b"odd\xff")


def run(*arguments, folder):
    p = run_ksl(*arguments, cwd=folder)
    assert p.returncode == 0, p.stderr
    return p.stdout


@pytest.fixture(params=["folder", "files"])
def work(request, tmp_path):
    """A folder of such a name, or files of such names."""
    try:
        folder = tmp_path / (ODD if request.param == "folder" else "plain")
        folder.mkdir()
        name = "" if request.param == "folder" else ODD
        for file, text in (
            (f"{name}robot.urdf", URDF),
            (f"{name}m.csv", MOTION),
            (f"{name}s.toml", SWEEP.replace("m.csv", "plain.csv")),
            ("plain.csv", MOTION),
        ):
            (folder / file).write_text(text)
    except (OSError, UnicodeEncodeError):
        pytest.skip("this file system takes UTF-8 only")
    return folder, name


def test_every_command(work):
    folder, name = work
    robot, motion, out = f"{name}robot.urdf", f"{name}m.csv", f"{name}o"
    run("loads", robot, motion, "-o", out, "--csv", "--json", folder=folder)
    with pa.OSFile(os.fsencode(folder / out / "wrenches.parquet")) as file:
        table = pq.read_table(file)
    assert table.num_rows == 2 * 9 and set(table["case"].to_pylist()) == {"odd\\udcffm" if name else "m"}
    provenance = json.loads(table.schema.metadata[b"ksl"])
    assert [f["file"] for f in provenance["inputs"]] == [robot, motion]
    report = json.loads((folder / out / "report.json").read_bytes())
    assert report["provenance"]["robot"] == "arm" and "�" not in (folder / out / "report.html").read_text(encoding="utf-8")[:200]
    run("loads", robot, motion, "-o", out, folder=folder)  # these are earlier results
    run("size", out, "-o", f"{name}z", folder=folder)
    run("view", robot, out, "--export", f"{name}v.html", folder=folder)
    run("hold", robot, "-o", f"{name}h", folder=folder)
    for suffix in ("csv", "parquet"):
        run("motion", robot, "--kind", "minjerk", "-o", f"{name}k.{suffix}", folder=folder)
        run("loads", robot, f"{name}k.{suffix}", "-o", f"{name}o2", folder=folder)
    assert "written to" in run("sweep", robot, f"{name}s.toml", "-o", f"{name}sweep", "--wrenches", folder=folder)
    run("size", f"{name}sweep", folder=folder)
    printed = run("loads", robot, motion, "-o", out, folder=folder)
    assert ("odd\\udcffo" in printed) == bool(name)
