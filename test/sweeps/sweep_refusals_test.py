"""What ksl.sweep and its command refuse, before anything is written, and what they take in the place of files."""

import errno
import subprocess
import sys

import numpy as np
import pytest

import ksl
from described_sweeps import HERE, PANDA, PAYLOAD, PICK, SPEED, TOOL, contents, described
from ksl_command import run_ksl


@HERE
def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OSError, match="file: is no folder, so results can't be written there; move it away"):
        ksl.sweep(PANDA, described(SPEED), tmp_path / "file", workers=1)
    full = OSError(errno.ENOSPC, "No space left on device")
    with pytest.MonkeyPatch.context() as m, pytest.raises(OSError, match=r"can't be written there \(No space left on device\); free some space"):
        m.setattr("ksl.output.part_files.flush", lambda *_: (_ for _ in ()).throw(full))
        ksl.sweep(PANDA, described(SPEED), tmp_path / "out", workers=1)
    assert not list((tmp_path / "out").rglob("*.part"))


@HERE
def test_results_of_another_sweep_are_kept_unless_forced(tmp_path):
    ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    before = contents(tmp_path)
    with pytest.raises(ksl.SweepError, match=r"holds another sweep \(.*--force to replace"):
        ksl.sweep(PANDA, described(PAYLOAD), tmp_path, workers=1)
    assert contents(tmp_path) == before
    assert ksl.sweep(PANDA, described(PAYLOAD), tmp_path, workers=1, force=True).computed == 3
    assert ksl.sweep(PANDA, described(PAYLOAD, seed=5), tmp_path, workers=1).computed == 0, "a grid has no seed"
    random = {"kind": "speed", "from": 0.5, "to": 1.0}
    ksl.sweep(PANDA, described(random, sampling="latin hypercube", cases=2), tmp_path / "random", workers=1)
    with pytest.raises(ksl.SweepError, match=r"holds another sweep \(with other cases\)"):
        ksl.sweep(PANDA, described(random, sampling="latin hypercube", cases=2, seed=5), tmp_path / "random", workers=1)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"vary": [SPEED]}, "give the motion once"),
        (described(SPEED, seed=-1), "seed = -1; expected a whole number"),
        (described(SPEED, cases=True, sampling="latin hypercube"), "cases = True; expected a whole number"),
        (described({**SPEED, "values": [True]}), "values has True; expected finite numbers"),
        (described({**SPEED, "values": [np.inf]}), "values has inf; expected finite numbers"),
        (described({"kind": "mass", "values": [-0.1]}), "a mass can't be negative"),
        (described({"kind": "tilt", "axis": [0, 1], "values": [1]}), "expected three finite numbers"),
        (described({"kind": "tilt", "axis": [0, True, 1], "values": [1]}), "expected three finite numbers"),
        (described({"kind": "speed", "from": 1, "to": 2, "steps": 0}), "needs `steps`"),
        (described({"kind": "speed", "from": 1, "to": 2, "steps": 10_000_001}), "at most 10,000,000"),
        (described({"kind": "mass", "values": [1, 2, 3]}, {"kind": "speed", "from": 1, "to": 2, "steps": 3_333_334}), "10,000,002 cases; at most 10,000,000"),
        (described({"kind": "speed", "from": 1, "to": 1}, sampling="latin hypercube", cases=3), "no range"),
        (described({"kind": "speed", "from": 1, "to": 2, "steps": 3}, sampling="latin hypercube", cases=3), "leave `steps` out"),
        (described({**SPEED, "steps": 2}), "has `values` and a range"),
        (described({**SPEED, "values": []}), "expected a list"),
        (described({**SPEED, "name": "joint"}), "expected a name for its column"),
        (described({**SPEED, "name": ""}), "expected a name for its column"),
        ({"base": {"motion": 3}, "vary": [SPEED]}, "motion = 3; expected the name of a file"),
        ({"base": {"motion": PICK, "stiffness": 3}, "vary": [SPEED]}, "stiffness = 3; expected the name of a file"),
        (described(), "nothing to vary"),
        (described({"kind": "sped", "values": [1]}), "did you mean 'speed'"),
        (described({**SPEED, "value": [1]}), "unknown key 'value'; did you mean 'values'"),
        (described({"kind": "speed", "values": [0]}), "speed factor 0"),
        (described({"kind": "speed", "from": 1, "to": 2}), "`steps`"),
        (described({"kind": "speed", "from": 1}), "`to` is missing"),
        (described({"kind": "speed", "from": 2, "to": 1}, sampling="latin hypercube", cases=3), "no range"),
        (described(SPEED, sampling="latin hypercube"), "needs `cases`"),
        (described(SPEED, sampling="random"), "sampling = 'random'"),
        (described(SPEED, SPEED), "two parameters are named 'speed'"),
        (described({"kind": "payload", "values": [1]}), "`link` is missing"),
        (described({"kind": "payload", "link": "panda_flang", "values": [1]}), "did you mean 'panda_flange'"),
        (described({"kind": "payload", "link": TOOL, "values": [-1]}), "can't be negative"),
        (described({"kind": "tilt", "values": [1]}), "`axis` is missing"),
        (described({"kind": "tilt", "axis": [0, 0, 0], "values": [1]}), "no direction"),
        (described({"kind": "mass", "values": ["heavy"]}), "finite numbers"),
        (described({"kind": "speed", "from": 1, "to": 2, "steps": 20_000_000}), "at most 10,000,000"),
        (described({"kind": "motion", "values": ["nowhere.csv"]}), "give the motion once"),
        ({"vary": [{"kind": "motion", "values": ["nowhere.csv"]}]}, "nowhere.csv"),
        (described({"kind": "speed", "values": [1e200]}), "case 0: speed = 1e"),
        ({**described(SPEED), "base": {"motion": PICK, "gravety": [0, 0, 0]}}, "did you mean 'gravity'"),
        ({**described(SPEED), "base": {"motion": PICK, "reading": {"degree": True}}}, "did you mean 'degrees'"),
        ({**described(SPEED), "base": {"motion": PICK, "reading": {"degrees": "yes"}}}, "degrees is 'yes'; expected true or false"),
        ({**described(SPEED), "base": {"motion": PICK, "reading": {"smooth": "20"}}}, "expected a number"),
        ({**described(SPEED), "base": {"motion": PICK, "components": "nowhere.toml"}}, "nowhere.toml: can't be read"),
        (described({**SPEED, "name": "effort_peak"}), "named like a column of the results"),
        ({**described(SPEED), "base": {"motion": PICK, "physics": ["dampin"]}}, r"\[base\]"),
    ],
)
def test_mistakes_are_named_before_anything_is_written(tmp_path, tables, words):
    with pytest.raises(ValueError, match=words):
        ksl.sweep(PANDA, tables, tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()


def test_robots_and_descriptions_that_are_none(tmp_path):
    with pytest.raises(ksl.SweepError, match="robot is int; expected a ksl.Model, or the name of a file"):
        ksl.sweep(7, described(SPEED), tmp_path)
    with pytest.raises(ksl.SweepError, match="description is int; expected a TOML file"):
        ksl.sweep(PANDA, 5, tmp_path)


@HERE
def test_a_model_in_place_of_a_file(tmp_path):
    """What a file and its [base] give, a model gives: gravity, physics; the folder knows it again, and another one too."""
    m = ksl.load(PANDA, payloads={TOOL: (1.0, (0, 0, 0.1))})
    tables = described(PAYLOAD) | {"base": {"motion": PICK, "gravity": [0, 0, -1.62]}}
    results = ksl.sweep(m, tables, tmp_path / "m")
    found = results.cases.to_table()
    same = ksl.sweep(ksl.load(PANDA, payloads={TOOL: (1.0, (0, 0, 0.1))}, gravity=(0, 0, -1.62)), described(PAYLOAD), tmp_path / "n")
    assert found.equals(same.cases.to_table()) and ksl.sweep(m, tables, tmp_path / "m").computed == 0
    with pytest.raises(ksl.SweepError, match="holds another sweep"):
        ksl.sweep(m.with_payload(TOOL, 0.5), tables, tmp_path / "m")
    with pytest.raises(ksl.SweepError, match=r"\[base\] mimic: the robot is a ksl.Model, which has been loaded already"):
        ksl.sweep(m, tables | {"base": {"motion": PICK, "mimic": "coupled"}}, tmp_path / "o")


def command(*arguments) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "ksl", "sweep", *map(str, arguments)], capture_output=True, text=True, timeout=120)


def test_the_command(tmp_path):
    (tmp_path / "sweep.toml").write_text(f'[base]\nmotion = "{PICK}"\n[[vary]]\nkind = "speed"\nvalues = [0.5, 1.0]\n')
    done = command(PANDA, tmp_path / "sweep.toml", "-o", tmp_path / "out", "--workers", 1)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].split() == ["joint", "limit", "of", "share", "in", "case"] and "2 cases computed" in done.stdout
    assert max(len(line) for line in lines if "written to" not in line) <= 80
    assert "0 cases computed" in run_ksl("sweep", PANDA, tmp_path / "sweep.toml", "-o", tmp_path / "out").stdout
    broken = tmp_path / "broken.toml"
    broken.write_text("[base\n")
    for arguments, words in (
        ((PANDA, broken), "is not TOML"),
        ((PANDA, tmp_path / "none.toml"), "can't be read"),
        ((PANDA, tmp_path / "sweep.toml", "--engine", "slurm"), "local"),
    ):
        done = run_ksl("sweep", *arguments, "-o", tmp_path / "other")
        assert done.returncode == 2 and words in done.stderr and done.stderr.count("\n") == 1 and not (tmp_path / "other").exists()
