"""ksl.check and `ksl check`: the list of findings, the table, the terminal, JSON, exit status."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from files import ARM, changed, hinge, link, more, stl
from rules_test import CASES

import ksl
from growth import assert_linear, work
from ksl.checks.description.findings import STATUS
from ksl.checks.run import RULES, TOPICS
from ksl_command import run_ksl

TWO = changed(('axis xyz="0 1 0"', 'axis xyz="0 0 0"'), ('effort="80"', 'effort="0"'))


def run(*arguments):
    return run_ksl("check", *arguments)


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "arm.urdf"
        path.write_text(text)
        return path

    return write


def test_findings_in_python(check):
    findings = check(TWO)
    assert isinstance(findings, ksl.Findings) and len(findings) == 2 and findings.status == 2 and findings.summary == "1 error, 1 warning"
    error, warning = findings
    assert (error.rule, error.severity, error.line, error.kind, error.name, error.value) == ("axis-zero", "error", 36 - 3, "joint", "elbow", 0)
    assert (warning.rule, warning.name, warning.place) == ("effort-zero", "shoulder", f"{findings.file}:27: joint shoulder")
    assert findings.errors == [error] and findings.warnings == [warning]
    assert repr(findings).splitlines()[0] == "<robot.urdf: 1 error, 1 warning>" and "axis 0 0 0 (axis-zero)" in repr(findings)
    assert findings[:1] == [error] and error in findings


def test_the_line_is_that_of_the_element(check):
    lines = TWO.splitlines()
    for finding in check(TWO):
        assert finding.found.split()[0] in lines[finding.line - 1]


def test_the_table(check):
    import pyarrow as pa

    table = check(TWO).table
    assert isinstance(table, pa.Table) and table.column("rule").to_pylist() == ["axis-zero", "effort-zero"]
    assert table.schema.field("line").type == pa.int32() and table.schema.field("value").type == pa.float64()
    assert json.loads(table.schema.metadata[b"ksl"])["file"].endswith("robot.urdf")
    assert check(ARM).table.num_rows == 0 and check(ARM).table.schema.names == table.schema.names


def test_ignored_rules(check):
    assert check(TWO, ignore=["axis-zero", "not-loaded"]).rules == {"effort-zero": 1}
    with pytest.raises(ValueError, match="did you mean 'axis-zero'"):
        check(TWO, ignore="axis-zer")
    with pytest.raises(ValueError, match="between 0 and 1"):
        check(TWO, symmetry=5)
    with pytest.raises(ValueError, match="no such folder"):
        check(TWO, package_paths="/nowhere")


def test_rules_are_declared_in_full():
    assert sum(len(rules) for rules in TOPICS.values()) == len(RULES)
    declaring = {rule.check.__module__.rpartition(".")[2] for rule in RULES.values()}
    assert declaring == {path.stem for path in (Path(__file__).resolve().parents[2] / "python/ksl/checks").glob("*_rules.py")}
    for name, rule in RULES.items():
        assert name == name.lower() and rule.condition.endswith(".") and rule.cause.endswith(".") and rule.repair.endswith(".") and rule.severity in STATUS


def test_exit_status(file):
    for text, status in ((ARM, 0), (CASES["effort-zero"][0], 1)):
        assert run(file(text)).returncode == status


def test_the_terminal(file):
    done = run(file(TWO))
    assert done.returncode == 2
    assert "error  axis-zero" in done.stdout and "line 33: joint elbow: axis 0 0 0" in done.stdout and done.stderr == ""
    assert done.stdout.splitlines()[-1].endswith("arm.urdf: 1 error, 1 warning")
    assert max(map(len, done.stdout.splitlines()[:-1])) <= 80


def test_many_places_of_a_rule(file):
    path = file(more(*(link(f"lost{i}") for i in range(9))))
    short, long = run(path), run(path, "--all")
    assert "… and 4 more; --all prints them" in short.stdout and "lost8" not in short.stdout
    assert "lost8" in long.stdout and "more;" not in long.stdout


def test_json(file):
    done = run(file(TWO), "--json", "--ignore", "effort-zero")
    value = json.loads(done.stdout)
    assert done.returncode == value["status"] == 2 and value["errors"] == 1 and value["ignored"] == ["effort-zero"]
    (finding,) = value["findings"]
    assert (
        finding["rule"] == "axis-zero" and finding["line"] == 33 and set(finding) >= {"severity", "found", "condition", "cause", "repair", "value", "fixable"}
    )


def test_fix_on_the_command_line(file, tmp_path):
    path = file(changed(('axis xyz="0 1 0"', 'axis xyz="0 0 5"'), ('effort="80"', 'effort="0"')))
    out = tmp_path / "new" / "out.urdf"
    out.parent.mkdir()
    done = run(path, "--fix", out)
    assert done.returncode == 1 and 'joint elbow: <axis> xyz: "0 0 5" is now "0 0 1" (axis-not-unit)' in " ".join(done.stdout.split())
    assert "Left for you to decide:" in done.stdout and "effort-zero" in done.stdout
    again = run(path, "--fix", out)
    assert again.returncode == 2 and "--force" in again.stderr and again.stdout == ""
    value = json.loads(run(path, "--fix", out, "--force", "--json").stdout)
    assert value["changes"][0]["rule"] == "axis-not-unit" and value["file"] == str(out)


@pytest.mark.parametrize(
    "arguments, sentence",
    [
        (["--ignore", "inertia-triangel"], "--ignore inertia-triangel: no such rule; did you mean 'inertia-triangle'"),
        (["--package-path", "/nowhere"], "--package-path /nowhere: no such folder"),
        (["--symmetry", "7"], "--symmetry 7.0: expected a share"),
        (["--accept", "limit-units"], "for --fix"),
        (["--fix", "x.urdf", "--accept", "limits"], "--accept limits: no such rule"),
    ],
)
def test_wrong_options(file, arguments, sentence):
    done = run(file(ARM), *arguments)
    assert done.returncode == 2 and sentence in done.stderr and done.stderr.count("\n") == 1 and done.stdout == ""


def test_sdf_with_lines(check):
    text = """<sdf version="1.10"><model name="m">
<link name="a"><inertial><mass>1</mass><inertia><ixx>0.05</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial></link>
<link name="b"><inertial><mass>-1</mass></inertial></link>
<joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz>
<limit><lower>2</lower><upper>1</upper><effort>-1</effort></limit></axis></joint></model></sdf>"""
    findings = check(text, "robot.sdf")
    assert {(f.rule, f.line) for f in findings} == {("inertia-triangle", 2), ("mass-negative", 3), ("limit-reversed", 5)}
    assert findings.not_checked and not any(f.fixable for f in findings)


@pytest.mark.parametrize(("frame", "told"), [("", True), (' relative_to="a"', False)])
def test_shapes_that_are_placed_by_other_frames_are_not_judged(check, frame, told):
    inertial = "<inertial><pose>0 0 9 0 0 0</pose><mass>1</mass><inertia><ixx>0.011</ixx><iyy>0.012</iyy><izz>0.013</izz></inertia></inertial>"
    shape = f"<collision name='c'><pose{frame}>0 0 0 0 0 0</pose><geometry><box><size>0.1 0.1 0.4</size></box></geometry></collision>"
    findings = check(f'<sdf version="1.11"><model name="m"><link name="a">{inertial}{shape}</link></model></sdf>', "robot.sdf")
    assert ("centroid-outside" in findings.rules) == told


def test_nothing_of_sdf_is_repaired(check, tmp_path):
    """What is repaired in URDF, in SDF: found, and left."""
    (tmp_path / "part.stl").write_bytes(stl())

    def body(name, mass=1.0, moments=(0.011, 0.012, 0.013), inside="", xyz="0 0 0"):
        numbers = "".join(f"<i{2 * k}>{x}</i{2 * k}>" for k, x in zip("xyz", moments))
        return f'<link name="{name}"><inertial><pose>{xyz} 0 0 0</pose><mass>{mass}</mass><inertia>{numbers}</inertia></inertial>{inside}</link>'

    def turn(name, child, limit="<lower>-1</lower><upper>1</upper>", xyz="0 0 1", more="", kind="revolute", parent="a"):
        return f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child><axis><xyz>{xyz}</xyz><limit>{limit}</limit>{more}</axis></joint>'

    box = "<collision name='c'><geometry><box><size>0.1 0.1 0.4</size></box></geometry></collision>"
    mesh = lambda uri, scale="1 1 1": f"<visual name='v'><geometry><mesh><uri>{uri}</uri><scale>{scale}</scale></mesh></geometry></visual>"
    follow = lambda leader: f'<mimic joint="{leader}"><multiplier>2</multiplier><offset>0</offset><reference>0</reference></mimic>'
    links = [
        body("a"), body("b", moments=(0.011, 0.012, -0.0001)), body("c", moments=(0.011, 0.012, 0.0235)), body("d", 1.0, inside=box, xyz="0 0 200"), body("e", 1000, (28, 28, 3.3), box), body("f", 2, (28300, 28300, 3300), box),
        body("g", 1, (0.0541, 0.0541, 0.0016), box, "0 0 0.2"), body("h", inside=mesh("Part.stl")), body("i", inside=mesh("model:///part.stl")), body("k", inside=mesh("part.stl", "900 900 900")), body("l"), body("m"), body("n"),
    ]  # fmt: skip
    joints = [
        turn("l_j1", "b", "<lower>1</lower><upper>-1</upper>"), turn("j_c", "c", "<lower>-90</lower><upper>90</upper>"), turn("j_d", "d", xyz="0 0 3"), turn("j_e", "e", "<lower>-1</lower><upper>1</upper><effort>-5</effort>"),
        turn("j_f", "f"), turn("j_g", "g"), turn("j_h", "h"), turn("j_i", "i"), turn("j_k", "K"), turn("l_j2", "l", more=follow("j1")), turn("j_m", "m", more=follow("j_f")), turn("j_n", "n", more=follow("j_m")),
        turn("j_o", "k", more=follow("J_F")),
    ]  # fmt: skip
    findings = check(f'<sdf version="1.11"><model name="m">{"".join(links)}{"".join(joints)}</model></sdf>', "robot.sdf")
    repaired = {
        "inertia-not-positive",
        "inertia-triangle",
        "centroid-outside",
        "mass-units",
        "inertia-units",
        "inertia-about-origin",
        "mesh-missing",
        "mesh-uri",
        "mesh-units",
    }
    repaired |= {"limit-reversed", "limit-units", "axis-not-unit", "limit-negative", "link-undefined", "mimic-unknown", "mimic-chain"}
    assert repaired <= set(findings.rules), repaired - set(findings.rules)
    assert not any(f.fixable or f.acceptable for f in findings)


def test_mjcf(check):
    pytest.importorskip("mujoco")
    text = """<mujoco><compiler balanceinertia="false" boundmass="0"/><worldbody>
<body name="Arm"><joint name="j" axis="0 0 1"/><inertial pos="0.1 0 0" mass="2" diaginertia="1 1 1"/>
<body name="arm"><joint name="k" axis="0 1 0"/><geom size="0.1"/></body></body></worldbody></mujoco>"""
    findings = check(text, "robot.xml")
    assert {(f.rule, f.line) for f in findings} == {("name-case", 3), ("inertia-placeholder", 2)}
    assert findings.not_checked


def test_nothing_that_is_found_depends_on_pose_or_order(check):
    """The same mistakes in the file's other order."""
    head, tail = TWO.split('<link name="upper">')
    upper, rest = tail.split("</link>", 1)
    turned = head + rest.replace("</robot>", '<link name="upper">' + upper + "</link></robot>")
    assert check(turned).rules == check(TWO).rules


def test_work_is_linear_in_links(tmp_path):
    def check(n: int) -> int:
        path = tmp_path / f"{n}.urdf"
        chain = "".join(link(f"l{i}") + hinge(f"j{i}", f"l{i - 1}" if i else "fore", f"l{i}") for i in reversed(range(n)))
        path.write_text(more(chain))
        found = []
        done = work(lambda: found.extend(ksl.check(path)))
        assert not found
        return done

    assert_linear(check, 100)


def test_names_in_the_way_of_patterns(check):
    """Names with regular expressions, markup and quotes."""
    assert check(more(link("[a](b)*&lt;"), hinge("[bold]j", "fore", "[a](b)*&lt;", '<dynamics damping="-1"/>'))).rules == {"dynamics-negative": 1}


@pytest.mark.parametrize("centroid, cause", [("0 0 -0.2", "The sign of z"), ("0 0 200", "millimetres"), ("0 0 0.8", "in other axes")])
def test_causes_of_a_centroid_outside(check, centroid, cause):
    (finding,) = check(changed(('<origin xyz="0 0 0.2"/>\n      <mass', f'<origin xyz="{centroid}"/>\n      <mass')))
    assert finding.rule == "centroid-outside" and cause in finding.cause
    assert finding.found.endswith("; the geometry has z from 0 to 0.4 m")


def test_without_lxml_one_sentence(check, monkeypatch):
    monkeypatch.setitem(sys.modules, "lxml", None)
    with pytest.raises(ksl.DescriptionError, match=r"needs lxml; install it with: pip install 'ksl\[check\]'"):
        check(ARM)


def test_the_second_moment_bound_by_hand():
    """Half the mass at each end of a rod of length 2 is the extreme that a body in its box can have: variance 1 = (1 − 0)(0 + 1)."""
    from ksl.checks.fit_rules import Fit
    from ksl.checks.description.robot import Inertial, FileLink

    box = np.array([[-1.0, -1, -1], [1, 1, 1]])
    I = np.diag([0.0, 2.0, 2.0])  # m = 2 kg at x = ±1 m
    inertial = Inertial(None, None, 2.0, np.zeros(3), np.eye(3), I)
    assert Fit(FileLink("rod", None, None, inertial), inertial, box, box[1] - box[0], 2.0).excess(I) == pytest.approx(1.0)
