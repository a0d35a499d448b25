"""FMUs: their XML, instances and states, the bits of m.simulate and of the model's calls, and what importers say of them."""

import ctypes
import subprocess
import sys
import zipfile
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest
from fmu_instance import DISCARD, ERROR, NUMBER, OK, WARNING, Fmu, Instance
from generated_code import EXAMPLES, FLAGS, FOLLOWED, run

import ksl
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


def test_joints_with_several_coordinates_agree_to_rounding(tmp_path):
    m = ksl.load(EXAMPLES / "ur5.urdf", floating_base=True).with_gravity((0, 0, -1))
    fmu, rng = Fmu(ksl.fmu(m, tmp_path, joints=[]), tmp_path / "unpacked"), np.random.default_rng(2)
    q, v, efforts = m.random(3), rng.normal(size=m.nv), rng.normal(size=m.nv)
    rows, s = moved(m, fmu, q, v, efforts), m.simulate(q, v, TIMES, efforts=efforts, method="rk4", step=FINE)
    expected = np.hstack([s.q, s.v, s.a])
    assert np.allclose(rows, expected, rtol=1e-11, atol=1e-11 * np.abs(expected).max()) and not np.allclose(rows[-1], rows[0], atol=0.01)
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
    with pytest.raises(ValueError, match="kind='forward': excavator has loops"):
        ksl.fmu(m, tmp_path)
    fmu = Fmu(ksl.fmu(m, tmp_path, kind="inverse", undetermined="least-norm"), tmp_path / "unpacked")
    one, q, still = Instance(fmu), m.close(m.neutral()).q, np.zeros(m.nv)
    assert one.set(fmu.names("input"), [*q, *still, *still]) == OK
    assert np.array_equal(one.get(fmu.names("output")), [*m.inverse_dynamics(q, still, still), *m.reactions(q, still, still).flat])
    assert one.set(fmu.names("input"), [*(q + 0.3), *still, *still]) == OK and np.isnan(one.get(fmu.names("output"), WARNING)).any() and "open" in one.said[-1]


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
    token = [
        ElementTree.fromstring(zipfile.ZipFile(ksl.fmu(ur5, tmp_path / f"{k}.fmu", compiler="", step=k)).read("modelDescription.xml")).get("instantiationToken")
        for k in (1, 2)
    ]
    assert token[0] != token[1]
    (tmp_path / "mine.fmu").write_text("mine")
    with pytest.raises(OutputError, match="--force"):
        ksl.fmu(ur5, tmp_path / "mine.fmu", compiler="")
    ksl.fmu(ur5, tmp_path / "mine.fmu", compiler="", force=True)
    monkeypatch.setenv("PATH", str(tmp_path))  # where no compiler is
    monkeypatch.setenv("KSL_CC", "")
    monkeypatch.setattr("ksl.generation.compiler.find_spec", lambda name: None)
    assert not [name for name in zipfile.ZipFile(ksl.fmu(ur5, tmp_path / "mine.fmu")).namelist() if name.startswith("binaries")]
    with pytest.raises(ksl.CompilerError, match="no-such-compiler"):
        ksl.fmu(ur5, tmp_path / "mine.fmu", compiler="no-such-compiler")


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
