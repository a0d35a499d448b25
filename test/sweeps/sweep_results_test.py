"""Results of a sweep: the worst cases, wrenches, utilisations, what metadata say, and partitions that are damaged."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as parquet
import pytest

import ksl
from described_sweeps import EXAMPLES, HERE, PANDA, PAYLOAD, PICK, SPEED, TOOL, described, many
from ksl.motions.reading import read_motion
from linkages import FOURBAR
from text_that_is_none import damaged_text


@HERE
def test_the_worst_cases_are_those_of_the_table(tmp_path):
    """Of all joints and quantities, from ten partitions: the largest value, and the first case that has it."""
    results = ksl.sweep(PANDA, many(), tmp_path, workers=1)
    table = sorted(results.cases.to_table().to_pylist(), key=lambda row: row["case"])
    rows = {(row["joint"], row["quantity"]): row for row in results.worst}
    quantities = [name for name in table[0] if name.endswith(("_peak", "_rms", "_share")) and not name.endswith("_at_peak")]  # of the peak, not the largest
    assert len(results.worst) == len(rows) > 100 and 0 < results.share_of_dynamics < 1
    for joint in {row["joint"] for row in table}:
        for quantity in quantities:
            there = [row for row in table if row["joint"] == joint and row[quantity] is not None]
            assert ((joint, quantity) in rows) == bool(there)
            if there:
                worst, found = max(there, key=lambda row: row[quantity]), rows[joint, quantity]
                assert (found["value"], found["case"], found["speed"], found["payload_panda_flange"]) == (
                    worst[quantity],
                    worst["case"],
                    worst["speed"],
                    worst["payload_panda_flange"],
                )
    assert (tmp_path / "worst.csv").read_text().startswith("joint,quantity,value,unit,case,payload_panda_flange,speed\n")


@HERE
def test_a_sweep_of_a_closed_mechanism_says_the_same_as_one_run(tmp_path):
    """With what rigid bodies leave open, in rows and worst cases."""
    fourbar, time = ksl.load_string(FOURBAR, drives=["A"]), np.linspace(0, 2, 201)
    np.savetxt(
        tmp_path / "crank.csv", np.column_stack([time, np.pi * (time - np.sin(np.pi * time) / np.pi)]), delimiter=",", header="time,A", comments="", fmt="%.17g"
    )
    sweep = {"base": {"motion": str(tmp_path / "crank.csv")}, "vary": [{"kind": "payload", "link": "rocker", "values": [0.0, 1.0]}]}
    results = ksl.sweep(fourbar, sweep, tmp_path / "swept", workers=1)
    run = ksl.compute_loads(fourbar, tmp_path / "crank.csv", payloads={"rocker": (1.0, (0, 0, 0))})
    swept = {row["joint"]: row for row in results.cases.to_table().to_pylist() if row["case"] == 1}
    assert list(swept) == ["A", "B", "D", "base", "C"]
    for row in run.rows:
        same = {k: x for k, x in row.items() if k not in ("case", "joint", "kind", "undetermined")}
        assert all(swept[row["joint"]][k] == row[k] for k in ("kind", "undetermined"))
        assert {k: swept[row["joint"]][k] for k in same} == pytest.approx(same, rel=1e-12), row["joint"]
    for row in results.worst:
        words = swept[row["joint"]]["undetermined"].split()
        assert row["undetermined"] == ("yes" if row["quantity"].rpartition("_")[0] in words else "no")
    assert {row["undetermined"] for row in results.worst} == {"yes", "no"}


@HERE
def test_what_a_sweep_says_of_its_time(tmp_path, monkeypatch):
    """By a clock that goes on by a second whenever it is looked at: twice for each case, and twice for each partition."""
    clock = SimpleNamespace(perf_counter=map(float, range(10**6)).__next__)
    monkeypatch.setattr("ksl.sweeps.evaluate.time", clock)
    monkeypatch.setattr("ksl.sweeps.compute_sweep.time", SimpleNamespace(perf_counter=iter([100.0, 107.5, 200.0, 201.0]).__next__))
    results = ksl.sweep(PANDA, many(steps=2, partition=3), tmp_path, workers=1)
    assert (results.seconds, results.share_of_dynamics) == (7.5, pytest.approx(10 / (2 * 10 + 4)))
    again = ksl.sweep(PANDA, many(steps=2, partition=3), tmp_path, workers=1)
    assert (again.seconds, again.share_of_dynamics, again.computed) == (1.0, 0.0, 0)


@HERE
def test_wrenches_on_request(tmp_path):
    results = ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1, wrenches=True)
    table = parquet.read_table(tmp_path / "wrenches" / "part-000000.parquet")
    samples = len(read_motion(ksl.load(PANDA), PICK).time)
    assert table.num_rows == 2 * samples * len(ksl.load(PANDA).joints) and results.computed == 2
    rows = zip(table["effort"].to_pylist(), table["joint"].to_pylist(), table["case"].to_pylist())
    effort = np.array([e for e, joint, case in rows if joint == "panda_joint4" and case == 0])
    assert np.abs(effort).max() == results.cases.to_table().to_pylist()[3]["effort_peak"]


@HERE
def test_utilisations_are_those_of_sizing_each_case(tmp_path):
    components = str(EXAMPLES / "components" / "panda.toml")
    tables = {"base": {"motion": PICK, "components": components}, "vary": [PAYLOAD]}
    results = ksl.sweep(PANDA, tables, tmp_path, workers=1)
    rows = results.cases.to_table().to_pylist()
    for case, mass in enumerate(PAYLOAD["values"]):
        sizing = ksl.size(ksl.compute_loads(PANDA, PICK, payloads={TOOL: (mass, PAYLOAD["center"])}), components)
        for row in (r for r in rows if r["case"] == case):
            found = [f for f in sizing.figures if f.joint == row["joint"] and f.utilisation is not None]
            assert (row["utilisation"], row["utilisation_of"]) == (
                (None, None) if not found else (pytest.approx(found[0].utilisation, rel=1e-9), f"{found[0].component}: {found[0].figure}")
            )
    worst = max((row for row in rows if row["utilisation"]), key=lambda row: row["utilisation"])
    assert max(r["value"] for r in results.worst if r["quantity"] == "utilisation") == worst["utilisation"]
    assert "sha256" in (tmp_path / "sweep.json").read_text() and "panda.toml" in (tmp_path / "sweep.json").read_text()


@HERE
@pytest.mark.parametrize("spectrum", ["[cases]\npick = 3\nidle = 0", "[shares]\npick = 0.7\nidle = 0.3"])
def test_one_file_of_components_serves_a_motion_and_a_sweep(tmp_path, spectrum):
    """Its spectrum is that of load cases, and is left out with a note."""
    (tmp_path / "c.toml").write_text(f'{spectrum}\n[[component]]\njoint = "panda_joint2"\nkind = "limits"\ntorque = 80\n')
    tables = {"base": {"motion": PICK, "components": str(tmp_path / "c.toml")}, "vary": [{"kind": "speed", "values": [1.0]}]}
    which, named = spectrum[: spectrum.index("]") + 1].replace("[", r"\[").replace("]", r"\]"), "it names pick, idle, and these are results of"
    with pytest.warns(ksl.DescriptionWarning, match=rf"{which} is left out: {named} a sweep"):
        swept = ksl.sweep(PANDA, tables, tmp_path / "out", workers=1)
    sizing = ksl.size(ksl.compute_loads(PANDA, PICK), tmp_path / "c.toml")
    assert any(f"is left out: {named} one case, panda_pick" in note for note in sizing.notes)
    assert [row["utilisation"] for row in swept.cases.to_table().to_pylist() if row["joint"] == "panda_joint2"] == pytest.approx(
        [sizing.worst.utilisation], rel=1e-9
    )


@HERE
def test_metadata_say_units_and_parameters(tmp_path):
    results = ksl.sweep(PANDA, described({**PAYLOAD, "values": np.array([0.0, 2.0])}), tmp_path, workers=1)
    said = json.loads(results.cases.to_table().schema.metadata[b"ksl"])
    assert said["robot"] == "panda" and said["parameters"][0]["unit"] == "kg" and "N m" in said["units"] and "first sample" in said["conventions"]
    units = {row["quantity"]: row["unit"] for row in results.worst if row["joint"] == "panda_joint2"}
    assert (units["effort_peak"], units["power_peak"], units["speed_share"]) == ("N m", "W", "")
    assert repr(results).startswith("<ksl sweep in ") and "of a limit" in repr(results) and len(repr(results)) < 250


@HERE
def test_motions_are_read_as_the_base_says(tmp_path, monkeypatch):
    """Degrees and a map, by names relative to the description, from wherever the sweep is started."""
    motion = ksl.read_motion(ksl.load(PANDA), PICK)
    names = [f"j{i}" for i in range(1, 8)]
    rows = np.column_stack([motion.time, np.degrees(motion.q)])
    (tmp_path / "in").mkdir()
    np.savetxt(tmp_path / "in" / "pick.csv", rows, delimiter=",", header=",".join(["time", *names]), comments="", fmt="%.17g")
    (tmp_path / "in" / "map.toml").write_text("[columns]\n" + "".join(f'j{i} = "panda_joint{i}"\n' for i in range(1, 8)))
    vary = '[[vary]]\nkind = "motion"\nvalues = ["pick.csv"]\n'
    (tmp_path / "in" / "sweep.toml").write_text(f'[base]\nreading = {{ degrees = true, map = "map.toml" }}\n{vary}')
    monkeypatch.chdir(tmp_path)
    row = ksl.sweep(PANDA, Path("in") / "sweep.toml", "out", workers=1).cases.to_table().to_pylist()[1]
    expected = ksl.sweep(PANDA, described({"kind": "speed", "values": [1]}), "other", workers=1).cases.to_table().to_pylist()[1]
    assert row["motion"] == "pick.csv" and row["effort_peak"] == pytest.approx(expected["effort_peak"], rel=1e-6)
    (tmp_path / "in" / "map.toml").write_text((tmp_path / "in" / "map.toml").read_text() + "\n")
    with pytest.raises(ksl.SweepError, match="holds another sweep"):
        ksl.sweep(PANDA, Path("in") / "sweep.toml", "out", workers=1)


@HERE
def test_damaged_and_unknown_partitions(tmp_path):
    ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    part = tmp_path / "cases" / "part-000000.parquet"
    whole = part.read_bytes()
    part.write_bytes(whole[:-100])
    with pytest.raises(ksl.SweepError, match="part-000000.parquet: is damaged; remove it"):
        ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    part.write_bytes(whole)
    table = parquet.read_table(part)
    parquet.write_table(table.set_column(table.schema.get_field_index("joint"), "joint", damaged_text(table.column("joint").to_pylist())), part)
    with pytest.raises(ksl.SweepError, match="part-000000.parquet: is damaged; remove it"):
        ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    part.unlink()
    assert ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1).computed == 2 and part.read_bytes() == whole
    (tmp_path / "sweep.json").unlink()
    for content in ("{}", '["fingerprint"]', "3", "{"):
        (tmp_path / "sweep.json").write_text(content)
        with pytest.raises(ksl.SweepError, match="sweep.json: is not the description of a sweep"):
            ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    (tmp_path / "sweep.json").unlink()
    with pytest.raises(ksl.SweepError, match="sweep.json beside it is missing"):
        ksl.sweep(PANDA, described(PAYLOAD), tmp_path, workers=1)
