"""FMUs: their XML, instances and states, the bits of m.simulate and of the model's calls, and what importers say of them."""

import ctypes
import re
import subprocess
import sys
import zipfile
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmu_instance import DISCARD, ERROR, NUMBER, OK, WARNING, Fmu, Instance
from generated_code import EXAMPLES, FLAGS, FOLLOWED, run

import ksl
from ksl import generation
from ksl.generation.arguments import Arguments
from ksl.generation.fmus.open_states import open_states
from ksl.generation.requests import functions_of
from ksl.output import OutputError

COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
TIMES = np.arange(9) / 64  # communication points whose differences are exact
FINE = 1 / 512


@pytest.fixture(scope="module")
def arm(ur5, tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    return Fmu(ksl.fmu(ur5, folder, name="arm"), folder / "unpacked")


def endings(m, *ends):
    return [f"{joint}{end}" for end in ends for joint in m.joint_names if m.joint(joint).nv]


def reactions_of(m):
    return [f"{joint}.reaction.{component}" for joint in m.joint_names if m.joint(joint).nv for component in COMPONENTS]


def moved(m, fmu, q, v, efforts, times=TIMES):
    """Outputs (times, numbers) under efforts (nv)."""
    one = Instance(fmu)
    assert one.set(fmu.names("parameter"), [FINE, *q, *v]) == OK and one.set(fmu.names("input"), efforts) == OK and one.begin() == OK
    rows = [one.get(fmu.names("output"))]
    for t, end in pairwise(times):
        assert one.step(t, end - t) == OK, one.said
        rows.append(one.get(fmu.names("output")))
    one.call("FreeInstance")
    return np.array(rows)


@pytest.mark.parametrize("method", ["rk4", "semi_implicit_euler"])
def test_a_mechanism_in_motion_has_the_bits_of_simulate(ur5, arm, tmp_path, method):
    fmu = arm if method == "rk4" else Fmu(ksl.fmu(ur5, tmp_path, method=method), tmp_path / "unpacked")
    assert fmu.names("output") == endings(ur5, "", ".v", ".a") + reactions_of(ur5)
    q, v, efforts = [0.1, -1, 0.5, 0.3, 0.2, 0.1], [1, 0, -2, 0, 0.5, 3], [1.0, -20, 3, 0.5, 0.2, 0.1]
    rows, s = moved(ur5, fmu, q, v, efforts), ur5.simulate(q, v, TIMES, efforts=efforts, method=method, step=FINE)
    assert np.array_equal(rows, np.hstack([s.q, s.v, s.a, ur5.reactions(s.q, s.v, s.a).reshape(len(TIMES), -1)]))


def test_joints_with_several_coordinates_have_the_bits_of_simulate(tmp_path):
    m = ksl.load(EXAMPLES / "ur5.urdf", floating_base=True).with_gravity((0, 0, -1))
    fmu, rng = Fmu(ksl.fmu(m, tmp_path, joints=[]), tmp_path / "unpacked"), np.random.default_rng(2)
    q, v, efforts = m.random(3), rng.normal(size=m.nv), rng.normal(size=m.nv)
    rows, s = moved(m, fmu, q, v, efforts), m.simulate(q, v, TIMES, efforts=efforts, method="rk4", step=FINE)
    assert np.array_equal(rows, np.hstack([s.q, s.v, s.a])) and not np.allclose(rows[-1], rows[0], atol=0.01)
    units = [fmu.variables[f"floating_base.{end}"].get("unit") for end in ("x", "qw", "vx", "wx", "ax", "bx", "effort.fx", "effort.tx")]
    assert units == ["m", None, "m/s", "rad/s", "m/s2", "rad/s2", "N", "N.m"]
    one = Instance(fmu)
    assert one.set(["floating_base.qw.start"], [0.5]) == OK and one.begin() == ERROR and "unit length" in one.said[-1]


def test_mimic_joints_follow(tmp_path):
    m = ksl.load_string(FOLLOWED)
    rows, s = (
        moved(m, Fmu(ksl.fmu(m, tmp_path), tmp_path / "unpacked"), [0.1, 0.2], [0, 1], [9, 0.1]),
        m.simulate([0.1, 0.2], [0, 1], TIMES, efforts=[9, 0.1], method="rk4", step=FINE),
    )
    assert np.array_equal(rows, np.hstack([s.q, s.v, s.a, m.reactions(s.q, s.v, s.a).reshape(len(TIMES), -1)]))


def test_instances_resets_and_states(ur5, arm):
    one, other = Instance(arm), Instance(arm)
    angles, efforts = endings(ur5, ""), arm.names("input")
    assert one.set(["elbow.start", "step"], [0.7, FINE]) == OK and one.get(["elbow"]) == 0.7
    assert one.begin() == OK and other.begin() == OK and one.set(efforts, np.ones(6)) == OK and one.step(0, 0.25) == OK
    assert np.array_equal(other.get(angles), np.zeros(6)) and one.get(["time"]) == 0.25
    state = one.kept()
    reached = one.get(arm.names("output"))
    assert one.step(0.25, 0.25) == OK and not np.array_equal(one.get(angles), reached[:6])
    assert one.call("SetFMUState", state) == OK and np.array_equal(one.get(arm.names("output")), reached)
    size, read = ctypes.c_size_t(), ctypes.c_void_p()
    assert one.call("SerializedFMUStateSize", state, ctypes.byref(size)) == OK
    bytes_ = ctypes.create_string_buffer(size.value)
    assert one.call("SerializeFMUState", state, bytes_, size) == OK
    assert other.call("DeserializeFMUState", bytes_, size, ctypes.byref(read)) == OK and other.call("SetFMUState", read) == OK
    assert np.array_equal(other.get(arm.names("output")), reached) and other.get(["time"]) == 0.25
    bytes_[3] = b"?"  # of the token
    assert other.call("DeserializeFMUState", bytes_, size, ctypes.byref(read)) == ERROR and "no state of this FMU" in other.said[-1]
    assert one.call("FreeFMUState", ctypes.byref(state)) == OK and state.value is None
    assert one.call("Terminate") == OK and one.step(0.25, 0.1) == ERROR and "terminated" in one.said[-1]
    assert one.call("Reset") == OK and one.get(["elbow"]) == 0
    assert one.call("EnterInitializationMode", False, NUMBER(0), NUMBER(5), False, NUMBER(0)) == OK and one.begin() == OK and one.step(5, 0.125) == OK


def test_what_is_wrong_is_said_and_changes_nothing(ur5, arm):
    stranger = Instance(arm, token="{0}", start=False)
    assert stranger.pointer is None and "instantiation token" in stranger.said[0]
    one = Instance(arm, start=False)
    assert one.begin() == ERROR and "the instance is instantiated" in one.said[-1]
    one = Instance(arm)
    assert one.set(["step"], [-1]) == OK and one.begin() == ERROR and "step must be above zero" in one.said[-1]
    assert one.set(["step"], [1e-3]) == OK and one.begin() == OK
    effort = arm.names("input")[0]
    for names, values, words in (
        (["elbow"], [1], "neither an input nor"), (["time"], [1], "neither an input nor"), (["elbow.start"], [1], "before the end of init"), ([effort, "elbow.effort"], [1, np.nan], "no finite number"), ([effort], [1, 2], "more or fewer"),
    ):  # fmt: skip
        assert one.set(names, values) == ERROR and words in one.said[-1]
    assert one.get([effort]) == 0
    for time, size, words in ((0, 0, "longer than zero"), (0, np.nan, "longer than zero"), (1, 1, "where the last one ended")):
        assert (
            one.call("DoStep", NUMBER(time), NUMBER(size), True, *(ctypes.byref(ctypes.c_bool()) for _ in range(3)), ctypes.byref(NUMBER())) == ERROR
            and words in one.said[-1]
        )
    assert one.step(0, 1e6) == DISCARD and one.set([effort], [1e300]) == OK and one.step(0, 1.0) == DISCARD and "smaller step" in one.said[-1]
    assert np.array_equal(one.get(endings(ur5, "")), np.zeros(6)) and one.get(["time"]) == 0
    for function in ("EnterEventMode", "EvaluateDiscreteStates"):
        assert one.call(function) == ERROR and function in one.said[-1]


def test_a_given_motion_has_the_bits_of_the_calls(ur5, tmp_path):
    fmu, rng = Fmu(ksl.fmu(ur5, tmp_path, kind="inverse", joints=["wrist_3", "elbow"]), tmp_path / "unpacked"), np.random.default_rng(1)
    assert fmu.names("input") == endings(ur5, "", ".v", ".a") and not fmu.names("parameter")
    one = Instance(fmu)
    assert one.begin() == OK
    for k in range(3):
        q, v, a = rng.normal(size=(3, 6))
        assert one.set(fmu.names("input"), [*q, *v, *a]) == OK
        assert np.array_equal(one.get(fmu.names("output")), [*ur5.inverse_dynamics(q, v, a), *ur5.reactions(q, v, a, joints=["wrist_3", "elbow"]).flat])
        assert one.step(k, 1) == OK


def test_closed_mechanisms_have_efforts_where_they_are_closed(tmp_path):
    m = ksl.load(EXAMPLES / "excavator.urdf")
    fmu = Fmu(ksl.fmu(m, tmp_path, kind="inverse", undetermined="least-norm"), tmp_path / "unpacked")
    one, q, still = Instance(fmu), m.close(m.neutral()).q, np.zeros(m.nv)
    assert one.set(fmu.names("input"), [*q, *still, *still]) == OK
    assert np.array_equal(one.get(fmu.names("output")), [*m.inverse_dynamics(q, still, still), *m.reactions(q, still, still).flat])
    assert one.set(fmu.names("input"), [*(q + 0.3), *still, *still]) == OK and np.isnan(one.get(fmu.names("output"), WARNING)).any() and "open" in one.said[-1]


@pytest.mark.parametrize(
    ("robot", "method", "step", "within"),
    [
        ("excavator", "rk4", 1e-3, 1e-12),
        ("excavator", "semi_implicit_euler", 1e-3, 1e-12),
        ("differential_wrist", "rk4", 1e-3, 1e-12),  # a helical joint
        ("two_rod_ankle, universal", "rk4", 1e-3, 1e-11),  # whose errors have another sign than their rates
        ("two_rod_ankle", "rk4", 1e-3, 1e-11),  # quaternions
        ("two_rod_ankle", "semi_implicit_euler", 1e-2, 1e-6),  # loops open by 1e-5 m in a step, whose square the nearest positions differ by
    ],
)
@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_closed_mechanisms_move_as_simulate_moves_them(tmp_path, robot, method, step, within):
    name, _, universal = robot.partition(", ")
    text = (EXAMPLES / f"{name}.urdf").read_text(encoding="utf-8")
    if universal:
        text = re.sub(r'(<constraint .*)spherical("(?:.*\n)*?.*<parent_origin .*)', r'\1universal\2<parent_axis xyz="1 0 0"/><parent_axis2 xyz="0 1 0"/>', text)
    m = ksl.load_string(text)
    assert not universal or [loop.kind for loop in m.loops] == ["universal"] * 2
    fmu = Fmu(ksl.fmu(m, tmp_path, method=method, joints=[], step=step), tmp_path / "unpacked")
    q, rng = m.close(m.neutral()).q, np.random.default_rng(1)
    v = m.consistent_velocity(q, 0.5 * rng.normal(size=m.nv), given=m.independent(q))
    one, efforts = Instance(fmu), np.zeros(m.nv)
    efforts[m.independent(q)[0]] = 0.1
    assert np.array_equal(one.get(fmu.names("output")[: m.nq]), q)  # what it starts with is closed
    assert one.set(fmu.names("parameter"), [step, *q, *v]) == OK and one.set(fmu.names("input"), efforts) == OK and one.begin() == OK
    rows = [one.get(fmu.names("output"))]
    for t, end in pairwise(TIMES):
        assert one.step(t, end - t) == OK, one.said
        rows.append(one.get(fmu.names("output")))
    s = m.simulate(q, v, TIMES, efforts=efforts, method=method, step=step)
    expected = np.hstack([s.q, s.v, s.a])
    assert np.allclose(rows, expected, rtol=0, atol=within * np.abs(expected).max()) and np.abs(rows[-1] - rows[0]).max() > 1e-3
    assert np.abs(m.loop_error([row[: m.nq] for row in rows])).max() < 1e-11


def test_closed_mechanisms_say_what_keeps_them_from_moving(tmp_path):
    m = ksl.load(EXAMPLES / "excavator.urdf")
    fmu = Fmu(ksl.fmu(m, tmp_path, undetermined="least-norm"), tmp_path / "unpacked")
    one, q = Instance(fmu), m.close(m.neutral()).q
    outputs, start = fmu.names("output"), fmu.names("parameter")[1:]
    assert np.array_equal(
        one.get(outputs)[2 * m.nv :], [*(a := m.forward_dynamics(q, np.zeros(m.nv), np.zeros(m.nv))), *m.reactions(q, np.zeros(m.nv), a).flat]
    )
    assert one.set(start, [*(q + 0.1), *np.zeros(m.nv)]) == OK and np.isnan(one.get(outputs, WARNING)[2 * m.nv :]).all()
    assert one.begin() == ERROR and "m.close" in one.said[-1]
    assert one.set(start, [*q, *np.eye(m.nv)[0]]) == OK and one.begin() == ERROR and "m.consistent_velocity" in one.said[-1]
    v = m.consistent_velocity(q, 10 * np.ones(m.nv), given=m.independent(q))
    assert one.set(start, [*q, *v]) == OK and one.begin() == OK and one.step(0, 0.125) == DISCARD and "pivots are too small" in one.said[-1]
    assert np.array_equal(one.get(outputs[: m.nq]), q)
    for options, words in (
        ({"scalar": "float", "joints": []}, "in float for a closed mechanism; ask for double"),
        ({}, r"^joints: reactions: not determined by rigid bodies: .*; ask for joints all of whose components are, joints=\["),
    ):
        with pytest.raises(ValueError, match=words):
            ksl.fmu(m, tmp_path, **options)
    with pytest.raises(ValueError, match="are not found in what was recorded"):
        open_states(m, functions_of(m, ["energy"], Arguments(), False, "refuse")[0])


CLOSED_NOWHERE = r"""
#include <float.h>
#include <math.h>
#include <string.h>
#define FMU_LOOPS 2
#define FMU_NQ 1
#define FMU_NV 1
#define FMU_LENGTH 1.0
#define FMU_ACCEPTED 1e-9
#define FMU_CLOSED 1e-12
#define FMU_RANK 1e-8
static void fmu_opening(const double *q, const double *v, double *error, double *rate) {
  error[0] = q[0], error[1] = 0, rate[0] = v[0], rate[1] = 0;
}
static void fmu_move(const double *q, const double *u, double *out) { out[0] = q[0] + u[0]; }
#include "closing.h"
int main(void) {
  double none[1] = {0}, q[1] = {0.1}, v[1] = {2};
  const double zero[1] = {0};
  none[0] = HUGE_VAL - HUGE_VAL;
  return !fmu_is_closed(zero, zero) + 2 * fmu_is_closed(none, zero) + 4 * fmu_is_closed(zero, none) + 8 * fmu_close(none, v) + 16 * !(fmu_close(q, v) && fabs(q[0]) < 1e-12 && v[0] == 2 - 2);
}
"""


def test_what_is_no_number_is_not_closed(tmp_path):
    """However small the errors are that come behind it."""
    (tmp_path / "p.c").write_text(CLOSED_NOWHERE)
    run("gcc", *FLAGS, f"-I{Path(generation.__file__).parent / 'fmus/fmi3'}", "p.c", "-o", "p", "-lm", cwd=tmp_path)
    run(tmp_path / "p", cwd=tmp_path)


def test_single_precision_has_the_bits_of_the_calls(ur5, tmp_path):
    fmu = Fmu(ksl.fmu(ur5, tmp_path, kind="inverse", scalar="float"), tmp_path / "inverse")
    q, v, a = np.random.default_rng(1).normal(size=(3, 6)).astype(np.float32)
    one = Instance(fmu)
    assert one.begin() == OK and one.set(fmu.names("input"), [*q, *v, *a]) == OK
    assert np.array_equal(one.get(fmu.names("output")), [*ur5.inverse_dynamics(q, v, a), *ur5.reactions(q, v, a).flat])
    assert one.set(["elbow"], [1e39]) == ERROR and "the FMU's precision" in one.said[-1]
    fmu = Fmu(ksl.fmu(ur5, tmp_path, scalar="float", method="semi_implicit_euler", joints=[], force=True), tmp_path / "forward")
    one, tau, h = Instance(fmu), np.array([1, -20, 3, 0.5, 0.2, 0.1], np.float32), np.float32(0.01)
    assert one.set(fmu.names("parameter"), [h, *q, *v]) == OK and one.set(fmu.names("input"), tau) == OK and one.begin() == OK
    assert one.step(0, 0.1) == OK  # ten steps, though 0.01 is rounded in single precision
    for _ in range(10):
        v = v + h * ur5.forward_dynamics(q, v, tau)
        q = q + h * v
    assert np.array_equal(one.get(fmu.names("output")), [*q, *v, *ur5.forward_dynamics(q, v, tau)])


HOSTILE = ["time", "step", 'a"<b>&', "]]>", "a", "a.start", "unseen\u200b", "ü漢", '*/ #include "x"', "${x}", "x' y"]


def test_names_of_a_file_are_text_and_no_two_variables_have_one(tmp_path):
    builder = ksl.Builder(HOSTILE[2] + "\u200b").add_link("base")
    for k, name in enumerate(HOSTILE):
        builder.add_link(f"l{k}", 1.0, (0.1, 0, 0), np.eye(3) * 0.1).add_joint(name, "revolute", f"l{k - 1}" if k else "base", f"l{k}", axis=(0, 0, 1))
    m = builder.build()
    fmu = Fmu(ksl.fmu(m, tmp_path, name="p"), tmp_path / "unpacked")
    assert fmu.root.get("modelName") == 'a"<b>&\\u200b'
    assert len(fmu.variables) == len(list(fmu.root.find("ModelVariables"))) == 2 + 12 * len(HOSTILE)
    assert fmu.names("output")[: len(HOSTILE)] == ["time_", "step_", *HOSTILE[2:5], "a.start_", "unseen\\u200b", *HOSTILE[7:]]
    sources = tmp_path / "unpacked/sources"
    files = [file.get("name") for file in ElementTree.parse(sources / "buildDescription.xml").iter("SourceFile")]
    for compiler in ("gcc", "clang"):
        run(compiler, *FLAGS, "-Wcomment", "-Wtrigraphs", "-fPIC", "-shared", *files, "-o", "code.so", "-lm", cwd=sources)
    run("gcc", *FLAGS, "-DFMI3_FUNCTION_PREFIX=p_", "-c", *files, cwd=sources)
    names = {line.split()[-1] for line in run("nm", "--defined-only", "-g", "fmi3.o", "fmi3_absent.o", cwd=sources).splitlines() if len(line.split()) == 3}
    assert len(names) == 76 and all(name.startswith("p_fmi3") for name in names)  # those of FMI 3.0, and one of ours


def test_files_are_the_same_each_time_and_those_of_others_stay(ur5, tmp_path, monkeypatch):
    first, second = (ksl.fmu(ur5, tmp_path / f"{k}/arm.fmu", compiler="").read_bytes() for k in range(2))
    assert first == second
    inside = zipfile.ZipFile(ksl.fmu(ur5, tmp_path / "whole.fmu", name="arm")).infolist()
    assert {(i.filename.startswith("binaries/"), oct(i.external_attr >> 16), i.date_time) for i in inside} == {
        (True, "0o755", (1980, 1, 1, 0, 0, 0)),
        (False, "0o644", (1980, 1, 1, 0, 0, 0)),
    }
    token = [
        ElementTree.fromstring(zipfile.ZipFile(ksl.fmu(ur5, tmp_path / f"{k}.fmu", compiler="", step=k)).read("modelDescription.xml")).get("instantiationToken")
        for k in (1, 2)
    ]
    assert token[0] != token[1] and len(token[0]) == 34
    (tmp_path / "mine.fmu").write_text("mine")
    with pytest.raises(OutputError, match="--force"):
        ksl.fmu(ur5, tmp_path / "mine.fmu", compiler="")
    ksl.fmu(ur5, tmp_path / "mine.fmu", compiler="", force=True)
    with monkeypatch.context() as elsewhere:  # on a processor that FMI has no name for
        elsewhere.setattr("platform.machine", lambda: "sparc64")
        assert not [name for name in zipfile.ZipFile(ksl.fmu(ur5, tmp_path / "mine.fmu", force=True)).namelist() if name.startswith("binaries")]
    monkeypatch.setenv("PATH", str(tmp_path))  # where no compiler is
    monkeypatch.setenv("KSL_CC", "")
    monkeypatch.setattr("ksl.generation.compiler.find_spec", lambda name: None)
    assert not [name for name in zipfile.ZipFile(ksl.fmu(ur5, tmp_path / "mine.fmu")).namelist() if name.startswith("binaries")]
    with pytest.raises(ksl.CompilerError, match="no-such-compiler"):
        ksl.fmu(ur5, tmp_path / "mine.fmu", compiler="no-such-compiler")
    monkeypatch.setenv("KSL_CC", "not-this-one-either")
    with pytest.raises(ksl.CompilerError, match="not-this-one-either"):
        ksl.fmu(ur5, tmp_path / "mine.fmu")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"kind": "both"}, "kind='both': expected forward or inverse"),
        ({"method": "dop853"}, "method='dop853': expected rk4 or semi_implicit_euler"),
        ({"step": 0}, "step=0: expected a finite time"),
        ({"step": "1"}, "step='1': expected a finite time"),
        ({"name": "fmi3"}, "name='fmi3'"),
        ({"name": "2p"}, "name='2p'"),
        ({"joints": ["elbo"]}, "did you mean 'elbow'"),
        ({"joints": ["elbow", "elbow"]}, "twice"),
        ({"undetermined": "some"}, "refuse or least-norm"),
        ({"scalar": "half"}, "scalar='half': expected double or float"),
        ({"scalar": "float", "step": 1.17e-38}, "step=1.17e-38: expected a time that single precision has"),
        ({"scalar": "float", "step": 1.71e38}, r"step=1.71e\+38: expected a time that single precision has"),
    ],
)
def test_what_is_refused_is_named_and_nothing_written(ur5, tmp_path, options, words):
    with pytest.raises(ValueError, match=words):
        ksl.fmu(ur5, tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "--algorithms: name some"),
        (["--fmu", "both"], "--fmu both: expected forward or inverse"),
        (["--fmu", "inverse", "--algorithms", "bias"], "--algorithms: is not for an FMU"),
        (["--fmu", "inverse", "--lanes", "4"], "--lanes: is not for an FMU"),
        (["--algorithms", "bias", "--step", "0.1"], "--step: is for an FMU"),
        (["--fmu", "inverse", "--step", "0.1"], "--step: is for --fmu forward"),
    ],
)
def test_the_command_says_which_option_is_wrong(tmp_path, arguments, words):
    p = subprocess.run(
        [sys.executable, "-m", "ksl", "generate", str(EXAMPLES / "ur5.urdf"), "-o", str(tmp_path / "out"), *arguments], capture_output=True, text=True
    )
    assert p.returncode == 2 and p.stderr.startswith(f"ksl: {words}") and not (tmp_path / "out").exists()


def test_the_example_of_the_page_in_fmpy(tmp_path, monkeypatch):
    """fmpy validates, simulates, and builds the sources."""
    validation, build = (pytest.importorskip(f"fmpy.{part}", reason="pip install fmpy") for part in ("validation", "build"))
    page = (EXAMPLES.parents[1] / "docs" / "c_code.md").read_text(encoding="utf-8")
    command = next(line for line in page.splitlines() if line.startswith("ksl generate") and "--fmu" in line)
    run(sys.executable, "-m", "ksl", *command.replace("build/ur5.fmu", str(tmp_path / "ur5.fmu")).split()[1:], cwd=EXAMPLES.parents[1])
    assert validation.validate_fmu(str(tmp_path / "ur5.fmu")) == []
    space = {"ksl": ksl}
    monkeypatch.chdir(EXAMPLES.parents[1])
    exec("import numpy as np\nimport fmpy\n" + page.split("import fmpy\n")[1].split("```")[0].replace("build/ur5.fmu", str(tmp_path / "ur5.fmu")), space)
    assert np.array_equal(space["found"]["elbow"], space["run"].q[:, 2]) and len(space["times"]) == 129
    fmu = Fmu(tmp_path / "ur5.fmu", tmp_path / "unpacked")
    fmu.path.unlink()
    build.build_platform_binary(tmp_path / "unpacked")
    assert fmu.path.exists()
