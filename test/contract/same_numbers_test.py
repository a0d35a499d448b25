"""A peak is one number: in the summary, the table of wrenches, the report and its JSON, the viewer, a sweep and sizing."""

import csv
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest

import ksl
from ksl.report.html.numbers import format_number
from ksl.load_cases.results_table import read_results
from ksl.viewer.results_scene import scene_of_motion, scene_of_results
from ksl_command import run_ksl

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PANDA, PICK = EXAMPLES / "robots" / "panda.urdf", EXAMPLES / "motions" / "panda_pick.csv"


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Results of the command, which writes the report and its JSON."""
    out = tmp_path_factory.mktemp("loads")
    done = run_ksl("loads", PANDA, PICK, "--json", "-o", out)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def peaks(folder) -> dict[str, dict[str, float]]:
    """{joint: {quantity: number}} of summary.csv, whose digits give the floating-point number back."""
    lines = [line for line in (folder / "summary.csv").read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert rows
    return {row["joint"]: {name: float(x) for name, x in row.items() if x and name not in ("case", "joint", "kind")} for row in rows}


def test_the_table_of_wrenches(folder, peaks):
    table = parquet.read_table(folder / "wrenches.parquet")
    joint, time = np.array(table["joint"].to_pylist()), table["time"].to_numpy()
    for name, row in peaks.items():
        if "effort_peak" in row:
            effort = np.abs(table["effort"].to_numpy()[joint == name])
            assert (effort.max(), time[joint == name][effort.argmax()]) == (row["effort_peak"], row["effort_peak_time"])


def test_json_and_report(folder, peaks):
    said = json.loads((folder / "report.json").read_text())
    for row in said["summary"]:
        assert {name: row[name] for name in peaks[row["joint"]]} == peaks[row["joint"]]
    shares = {(use["joint"], use["quantity"]): use for use in said["verdict"]["uses"]}
    page = (folder / "report.html").read_text()
    for name in (n for n in peaks if "effort_peak" in peaks[n]):
        assert shares[name, "effort"]["value"] == peaks[name]["effort_peak"]
        assert shares[name, "speed"]["value"] == peaks[name]["speed_peak"]
        assert format_number(peaks[name]["effort_peak"]) in page


def test_python(peaks):
    run = ksl.compute_loads(PANDA, PICK)
    for row in run.summary.to_pylist():
        assert {name: row[name] for name in peaks[row["joint"]]} == peaks[row["joint"]]


def test_viewer(folder, peaks):
    """Its wrenches are in world axes: their magnitudes are the same but for the rounding of the rotation."""
    model = ksl.load(PANDA)
    motion = ksl.read_motion(model, PICK)
    scenes = [scene_of_motion(model, motion.time, motion.q, motion.v, motion.a, {}), scene_of_results(model, read_results(folder))[0]]
    for scene in scenes:
        total = scene.constraint + scene.actuation
        for i, joint in enumerate(model.joints):
            row = peaks[joint.name]
            if "effort_peak" in row:
                effort = np.abs(scene.effort[:, i])
                assert (effort.max(), scene.time[effort.argmax()]) == (row["effort_peak"], row["effort_peak_time"])
                assert scene.utilisation[:, i].max() == row["effort_peak"] / joint.effort
            else:
                assert np.linalg.norm(total[:, i, 3:], axis=1).max() == pytest.approx(row["moment_peak"], rel=1e-12)


@pytest.mark.usefixtures("sweeps_here")
def test_sweep(tmp_path, folder, peaks):
    """Of one case, which changes nothing."""
    results = ksl.sweep(PANDA, {"base": {"motion": str(PICK)}, "vary": [{"kind": "speed", "values": [1.0]}]}, tmp_path / "sweep", workers=1)
    rows = {row["joint"]: row for row in results.cases.to_table().to_pylist()}
    assert list(rows) == list(peaks)
    for name, row in peaks.items():
        assert {key: rows[name][key] for key in row} == row
    for use in json.loads((folder / "report.json").read_text())["verdict"]["uses"]:
        assert rows[use["joint"]][f"{use['quantity']}_share"] == use["share"]


def test_sizing(folder, peaks):
    """Its sets are signed; the larger of both extremes is the peak."""
    rows = ksl.size(folder).peaks
    for name in (n for n in peaks if "effort_peak" in peaks[n]):
        extremes = [abs(row["effort"]) for row in rows if row["joint"] == name and row["extreme"].startswith("effort")]
        assert max(extremes) == peaks[name]["effort_peak"]
