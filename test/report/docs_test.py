"""The report in docs/loads.md: its example runs, and its table of keys is complete."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ksl.report.pdf import BROWSERS, VARIABLE
from ksl_command import run_ksl

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "loads.md").read_text(encoding="utf-8")
DOC = PAGE[PAGE.index("\n## The report\n") : PAGE.index("\n## From Python\n")]


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    done = run_ksl("loads", ROOT / "examples/robots/panda.urdf", ROOT / "examples/motions/panda_pick.csv", "-o", folder / "loads", "--json",
               "--components", ROOT / "examples/components/panda.toml")  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder


def test_the_table_of_keys_is_complete(run):
    said = json.loads((run / "loads" / "report.json").read_text(encoding="utf-8"))
    table = DOC[DOC.index("### report.json") :]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == list(said)
    for key in (*said["verdict"], *said["verdict"]["uses"][0], *said["cases"][0], *said["cases"][0]["power_balance"]):
        assert f"`{key}`" in table, key
    assert said["sizing"]["figures"] and {"sha256", "role", "file"} == set(said["provenance"]["inputs"][0])


def test_the_numbers_are_those_of_the_summary(run):
    import csv

    said = json.loads((run / "loads" / "report.json").read_text(encoding="utf-8"))["summary"]
    with open(run / "loads" / "summary.csv", newline="", encoding="utf-8") as f:
        rows = list(csv.DictReader(line for line in f if not line.startswith("# ")))
    for row, expected in zip(said, rows, strict=False):
        assert all(str(row[key]) == value for key, value in expected.items() if value), row["joint"]


def test_the_example_runs(run):
    code = re.search(r"```python\n(.*?)```", DOC, re.DOTALL)[1]
    done = subprocess.run([sys.executable, "-c", code], cwd=run, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("panda_joint1 0.08")


def test_components_stand_beside_their_joints(run):
    page = (run / "loads" / "report.html").read_text(encoding="utf-8")
    assert page.count('class="verdict ') == 1 and "Components: <strong" in page and "Payloads: none" in page
    assert "/.ksl-" not in page  # the folder in which results are written before they are moved
    assert page.count('class="sizing"') >= 7


@pytest.mark.parametrize(
    ("torque", "joints", "level", "said"),
    [(1e3, [], "green", "all 1 figures"), (1.0, [], "red", "1 of 1 figures is over"), (1e3, ["--joints", "panda_joint1"], "amber", "nothing was compared")],
)
def test_terminal_page_and_json_have_one_word_for_components(tmp_path, torque, joints, level, said):
    (tmp_path / "c.toml").write_text(f'[[component]]\njoint = "panda_joint2"\nkind = "limits"\ntorque = {torque}\n')
    two = ROOT / "examples/robots/panda.urdf", ROOT / "examples/motions/panda_pick.csv"
    done = run_ksl("loads", *two, "-o", tmp_path, "--json", "--components", tmp_path / "c.toml", "--fail-on", "limits", *joints)
    last = done.stdout.rstrip().splitlines()[-1]
    assert last.startswith(f"components: {level.upper()}: panda: {said}") and done.returncode == (3 if level == "red" else 0), done.stdout
    assert json.loads((tmp_path / "report.json").read_text())["level"] == level
    assert f'<section id="verdict" class="verdict {level}">' in (page := (tmp_path / "report.html").read_text())
    assert ("all components hold" in page, "no component was compared with a limit" in page) == (level == "green", level == "amber")
    assert done.stdout.count("every figure is left out") == page.count("every figure is left out") == (level == "amber")


def test_a_missing_browser_is_said_before_anything_is_computed(tmp_path):
    assert ", ".join(f"`{name}`" for name in BROWSERS[:3]) in DOC and VARIABLE in DOC
    for environment, words in (
        ({"PATH": str(tmp_path)}, "a PDF needs Chromium, Chrome or Edge"),
        ({VARIABLE: "nothere"}, f"{VARIABLE}=nothere: no such program"),
    ):
        done = run_ksl("loads", ROOT / "examples/robots/panda.urdf", ROOT / "examples/motions/panda_pick.csv", "-o", tmp_path / "o", "--pdf", **environment)
        assert done.returncode == 2 and words in done.stderr and not (tmp_path / "o").exists()


def test_a_browser_that_fails_leaves_nothing(tmp_path):
    done = run_ksl("loads", ROOT / "examples/robots/panda.urdf", ROOT / "examples/motions/panda_pick.csv", "-o", tmp_path / "o", "--pdf", KSL_BROWSER="false")
    assert done.returncode == 2 and "printed no PDF" in done.stderr and not (tmp_path / "o").exists()


def test_an_unknown_paper(tmp_path):
    done = run_ksl("loads", ROOT / "examples/robots/panda.urdf", ROOT / "examples/motions/panda_pick.csv", "-o", tmp_path / "o", "--paper", "A3")
    assert done.returncode == 2 and "--paper A3: expected A4 or letter" in done.stderr


def test_components_that_cannot_be_are_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "c.toml").write_text('[[component]]\njoints = ["panda_joint1"]\nkind = "moter"\n')
    two = ROOT / "examples/robots/panda.urdf", ROOT / "examples/motions/panda_pick.csv"
    done = run_ksl("loads", *two, "-o", tmp_path / "o", "--components", tmp_path / "c.toml")
    assert done.returncode == 2 and "moter" in done.stderr and "motor" in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "o").exists()


def test_wrenches_that_components_cannot_take_are_refused_by_the_name_of_the_folder(tmp_path):
    (tmp_path / "c.toml").write_text('[[component]]\njoint = "panda_joint2"\nkind = "limits"\ntorque = 9\n')
    two = ROOT / "examples/robots/panda.urdf", ROOT / "examples/motions/panda_pick.csv"
    done = run_ksl("loads", *two, "-o", tmp_path / "o", "--components", tmp_path / "c.toml", "--axes", "world")
    assert done.returncode == 2 and done.stderr.startswith(f"ksl: {tmp_path / 'o'}: wrenches are in the axes `world`"), done.stderr


def test_several_load_cases_are_one_page(tmp_path):
    done = run_ksl("loads", ROOT / "examples/robots/ur5.urdf", "--cases", ROOT / "examples/cases/ur5_cases.toml", "-o", tmp_path / "o", "--json")
    assert done.returncode == 0, done.stderr
    page, said = ((tmp_path / "o" / name).read_text(encoding="utf-8") for name in ("report.html", "report.json"))
    shown = [case["name"] for case in json.loads(said)["cases"]]
    assert page.count('<article class="case"') == len(shown) > 1
    assert re.search(r'<select id="choice">(.*?)</select>', page)[1] == "".join(f'<option value="{i}">{name}</option>' for i, name in enumerate(shown))
    worst = page[page.index('id="worst"') : page.index('<article class="case"')]
    assert "emergency" in worst and "brakes" in worst and f"Curves of {len(shown)} of 8 load cases are shown" in worst
    assert len(page.encode()) < 8e6
