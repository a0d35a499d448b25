"""Generated C: compiled by both compilers without a word, with the engine's bits, and never made of a robot's names."""

import ctypes
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from generated_code import EXAMPLES, FLAGS, call, compiled, run, spatial_four_bar

import ksl
from ksl.generation import c99, requests
from ksl.output import OutputError

ALGORITHMS = ["inverse_dynamics", "forward_dynamics", "jacobian:tool0", "reactions", "energy", "hybrid_dynamics:elbow", "relative_pose:tool0+base_link"]
ALGORITHMS += ["mass_matrix_upper", "jvp.mass_matrix_upper"]  # not written whole


@pytest.mark.parametrize("scalar", ["double", "float"])
def test_both_compilers_take_it_and_its_self_test_passes(ur5, tmp_path, scalar):
    ksl.generate(ur5, ALGORITHMS, tmp_path, name="ur5", scalar=scalar, arguments=["gravity", "external:tool0+elbow"] if scalar == "double" else [])
    for compiler in ("gcc", "clang"):
        run(compiler, *FLAGS, "ur5.c", "ur5_test.c", "-o", "test", "-lm", cwd=tmp_path)
        assert run(tmp_path / "test", cwd=tmp_path) == "all results agree\n"
    (tmp_path / "user.cpp").write_text('#include "ur5.h"\nint main() { return UR5_NV - 6; }\n')
    run("g++", "-std=c++17", "-Wall", "-pedantic", "-Werror", "user.cpp", "-o", "user", cwd=tmp_path)
    run("gcc", *FLAGS, "-c", "ur5.c", "-o", "ur5.o", cwd=tmp_path)
    called = {line.split()[-1] for line in run("nm", "-u", "ur5.o", cwd=tmp_path).splitlines()}
    assert called <= {"sqrt", "fabs", "sqrtf", "fabsf", "fmaf", "_GLOBAL_OFFSET_TABLE_", "memset", "memcpy"}
    sections = dict(line.split()[:2] for line in run("size", "-A", "-d", "ur5.o", cwd=tmp_path).splitlines() if line.startswith((".data ", ".bss ")))
    assert set(sections.values()) <= {"0"}


def test_the_command_and_the_controller_of_the_page(tmp_path):
    page = (EXAMPLES.parents[1] / "docs" / "c_code.md").read_text(encoding="utf-8")
    command = next(line for line in page.splitlines() if line.startswith("ksl generate"))
    words = command.replace("build/ur5_c", str(tmp_path)).split()[1:]
    run(sys.executable, "-m", "ksl", *words, cwd=EXAMPLES.parents[1])
    (tmp_path / "user.c").write_text(page.split("```c\n")[1].split("```")[0])
    run("gcc", "-std=c99", "-Wall", "-Werror", "-c", "user.c", "ur5_test.c", "ur5.c", cwd=tmp_path)


def test_the_self_test_notices_a_wrong_result(ur5, tmp_path):
    ksl.generate(ur5, ["inverse_dynamics"], tmp_path, name="p")
    source = (tmp_path / "p.c").read_text()
    assert source.count("tau[3] = ") == 1
    (tmp_path / "p.c").write_text(source.replace("tau[3] = ", "tau[3] = 1.001 * "))
    run("gcc", "-w", "p.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
    assert subprocess.run([tmp_path / "test"], capture_output=True).returncode == 1


@pytest.mark.parametrize(("scalar", "dtype"), [("double", np.float64), ("float", np.float32)])
def test_bits_of_the_engine_at_angles_of_all_sizes_in_place_and_in_parts(ur5, tmp_path, monkeypatch, scalar, dtype):
    rng = np.random.default_rng(4)
    states = [[rng.normal(size=6).astype(dtype) * size for size in (s, 1, 3)] for s in (1, 1, 30, 1e4, 4e8, 1e15)]
    for k, straight in enumerate((c99.STRAIGHT, 100)):
        monkeypatch.setattr(c99, "STRAIGHT", straight)
        monkeypatch.setattr(c99, "PART", 60)
        folder = tmp_path / str(k)
        ksl.generate(ur5, ["inverse_dynamics", "reactions"], folder, name="p", scalar=scalar)
        assert ("_part_2(" in (folder / "p.c").read_text()) == (straight == 100)
        code = compiled(folder, "p")
        for q, v, a in states:
            expected = ur5.inverse_dynamics(q, v, a)
            assert expected.dtype == dtype
            assert np.array_equal(call(code.p_inverse_dynamics, (q, v, a), [6], dtype)[0], expected)
            assert np.array_equal(call(code.p_reactions, (q, v, a), [36], dtype)[0].reshape(6, 6), ur5.reactions(q, v, a))
            there = q.copy()
            code.p_inverse_dynamics(*(ctypes.c_void_p(x.ctypes.data) for x in (there, v, a, there)))
            assert np.array_equal(there, expected)


def test_gravity_and_wrenches_are_inputs(ur5, tmp_path):
    ksl.generate(ur5, ["inverse_dynamics", "mass_matrix"], tmp_path, name="p", arguments=["external:tool0", "gravity"])
    header = (tmp_path / "p.h").read_text()
    assert "void p_inverse_dynamics(const double *q, const double *v, const double *a, const double *external, const double *gravity, double *tau);" in header
    assert "void p_mass_matrix(const double *q, double *M);" in header  # which neither matters to
    rng = np.random.default_rng(1)
    q, v, a, push, gravity = (rng.normal(size=n) for n in (6, 6, 6, 6, 3))
    (found,) = call(compiled(tmp_path, "p").p_inverse_dynamics, (q, v, a, push, gravity), [6])
    assert np.array_equal(found, ur5.with_gravity(gravity).inverse_dynamics(q, v, a, external={"tool0": push}))


def test_bytes_of_code_are_about_those_of_the_readme(ur5, tmp_path):
    ksl.generate(ur5, ["inverse_dynamics", "forward_dynamics", "mass_matrix", "frame_poses", "jacobian:tool0", "energy"], tmp_path, name="p")
    run("gcc", *FLAGS, "-O2", "-c", "p.c", "-o", "p.o", cwd=tmp_path)
    found = {symbol[-1]: int(symbol[1], 16) for symbol in map(str.split, run("nm", "-S", "p.o", cwd=tmp_path).splitlines()) if len(symbol) == 4}
    rows = [line.strip("| ").split(" | ") for line in (tmp_path / "README.md").read_text().splitlines() if line.startswith("| `p_")]
    assert len(rows) == 6
    for name, *_, said in rows:
        assert 0.75 < found[name.strip("`")] / int(said) < 1.25, name


def test_closed_mechanisms_have_the_bits_of_their_plan_or_nan(tmp_path):
    m, rng = ksl.load(EXAMPLES / "excavator.urdf"), np.random.default_rng(1)
    ksl.generate(m, ["inverse_dynamics", "forward_dynamics", "reactions", "bias", "frame_pose:bucket"], tmp_path, name="p", undetermined="least-norm")
    run("gcc", *FLAGS, "p.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
    run(tmp_path / "test", cwd=tmp_path)
    code, start, served = compiled(tmp_path, "p"), m.close(m.neutral()).q, 0
    for _ in range(30):
        found = m.close(m.integrate(start, rng.normal(size=m.nv) * 0.1))
        q, moved = np.ascontiguousarray(found.q), rng.normal(size=(3, m.nv))
        v = m.consistent_velocity(q, moved[0], given=m.independent(q))
        a = m.consistent_acceleration(q, v, moved[1], given=m.independent(q))
        (tau,) = call(code.p_inverse_dynamics, (q, v, a), [m.nv])
        if found.converged and np.isfinite(tau).all():
            served += 1
            assert np.array_equal(tau, m.inverse_dynamics(q, v, a))
            assert np.array_equal(call(code.p_reactions, (q, v, a), [6 * m.nv])[0].reshape(-1, 6), m.reactions(q, v, a))
            assert np.array_equal(call(code.p_forward_dynamics, (q, v, moved[2]), [m.nv])[0], m.forward_dynamics(q, v, moved[2]))
            assert np.array_equal(call(code.p_bias, (q, v), [m.nv])[0], m.bias(q, v))
        assert np.isnan(call(code.p_forward_dynamics, (q + 0.3, v, moved[2]), [m.nv])[0]).all()  # open
    assert served > 20


def test_reactions_that_rigid_bodies_leave_open_are_refused_by_name(tmp_path):
    excavator = ksl.load(EXAMPLES / "excavator.urdf")
    with pytest.raises(ValueError, match="fy, tx, tz of stick_hinge.*least norm"):
        ksl.generate(excavator, ["reactions:stick_hinge"], tmp_path / "out")
    assert not (tmp_path / "out").exists()
    ksl.generate(spatial_four_bar(), ["reactions", "inverse_dynamics"], tmp_path, name="p", arguments=["payload:rod"])
    run("gcc", *FLAGS, "p.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
    run(tmp_path / "test", cwd=tmp_path)


HOSTILE = ['j */ #include "x" \\', "int x;", "??/", '"); system("', "`<b>${x}", "ü漢"]


def test_names_of_a_file_never_become_code(tmp_path):
    builder = ksl.Builder(HOSTILE[0])
    builder.add_link("base")
    parent = "base"
    for k, name in enumerate(HOSTILE):
        link = f"l{k} {name}"
        builder.add_link(link, 1.0, (0.1, 0, 0), np.eye(3) * 0.1).add_joint(name, "revolute", parent, link, axis=(0, 0, 1))
        parent = link
    m = ksl.load_string(builder.build().to_urdf())
    ksl.generate(m, ["inverse_dynamics", f"jacobian:{m.link_names[1]}"], tmp_path, name="p", lanes=4, cuda=True)
    for file in ("p.h", "p.c", "p_test.c", "p_lanes.h", "p_lanes.c", "p.cuh", "p.cu", "CMakeLists.txt", "library.json", "README.md"):
        text = (tmp_path / file).read_text()
        assert text.isascii() and "\\\n" not in text and "??/" not in text and "<b>" not in text
    assert "system" not in (tmp_path / "CMakeLists.txt").read_text()
    run("gcc", *FLAGS, "-Wcomment", "-Wtrigraphs", "-march=x86-64-v3", "p.c", "p_lanes.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
    run(tmp_path / "test", cwd=tmp_path)
    names = (ctypes.c_char * 64 * 5).in_dll(compiled(tmp_path, "p"), "p_position_names")
    width = int((tmp_path / "p.h").read_text().split("P_NAME_BYTES ")[1].split()[0])
    flat = bytes(memoryview(names).cast("B"))
    assert [flat[k * width : (k + 1) * width].split(b"\0")[0].decode() for k in range(len(HOSTILE))] == HOSTILE


@pytest.mark.parametrize(
    ("algorithms", "options", "words"),
    [
        (["inverse_dynamic"], {}, "did you mean inverse_dynamics"),
        (["jacobian"], {}, "jacobian:LINK"),
        (["jacobian:tool"], {}, "tool0"),
        (["inverse_dynamics:elbow"], {}, "names no links"),
        (["jacobian:"], {}, "behind the colon"),
        ([".energy"], {}, "a derivative is jvp.energy or vjp.energy"),
        (["energy"], {"derivatives": 2}, "derivatives=2: are those of functions for CasADi"),
        (["energy"], {"flash": "9k"}, "flash='9k': expected a number of bytes"),
        (["reactions", "reactions:elbow"], {}, "both be called reactions"),
        ([], {}, "algorithms is empty"),
        (["velocity_jump"], {}, "external:LINK"),
        (["hybrid_dynamics"], {}, "hybrid_dynamics:JOINT"),
        (["mass_matrix"], {"name": "2p"}, "name='2p'"),
        (["mass_matrix"], {"name": "p" * 32}, f"name='{'p' * 32}': is no name for C; expected at most 31 letters"),
        (["mass_matrix"], {"name": "while"}, "name='while'"),
        (["mass_matrix"], {"name": "a b"}, "name='a b'"),
        (["mass_matrix"], {"name": "math"}, "name='math'"),
        (["mass_matrix"], {"name": "test"}, "name='test'"),
        (["mass_matrix"], {"scalar": "half"}, "double or float"),
        (["mass_matrix"], {"arguments": ["mass"]}, "gravity, external"),
        (["mass_matrix"], {"arguments": ["payload"]}, "payload:LINK"),
        (["mass_matrix"], {"arguments": ["parameters:tool0+tool0"]}, "parameters names a link twice"),
        (["mass_matrix"], {"arguments": ["external:tool0", "external:tool0"]}, "external names a link twice"),
        (["mass_matrix"], {"undetermined": "some"}, "refuse or least-norm"),
        (["grad.mass_matrix"], {}, "jvp.mass_matrix or vjp.mass_matrix"),
        (["vjp.integrate"], {}, "integrate_jacobians"),
    ],
)
def test_what_is_refused_is_named_and_nothing_written(ur5, tmp_path, algorithms, options, words):
    with pytest.raises(ValueError, match=words):
        ksl.generate(ur5, algorithms, tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_text_is_bounded(ur5, tmp_path, monkeypatch):
    monkeypatch.setattr(requests, "MOST_STATEMENTS", 500)
    with pytest.raises(ValueError, match="inverse_dynamics of this robot is 5.. statements"):
        ksl.generate(ur5, ["mass_matrix_tree", "inverse_dynamics"], tmp_path / "out")


def test_mechanisms_that_cannot_be_generated_are_refused_by_name(tmp_path):
    excavator = ksl.load(EXAMPLES / "excavator.urdf")
    for asked, options, words in ((["mass_matrix"], {}, "closed mechanism"), (["forward_dynamics"], {"scalar": "float"}, "ask for double")):
        with pytest.raises(ValueError, match=words):
            ksl.generate(excavator, asked, tmp_path / "out", **options)
    with pytest.raises(ValueError, match="no joint that moves"):
        ksl.generate(ksl.Builder("still").add_link("base", 1.0).build(), ["inverse_dynamics"], tmp_path / "out")


def test_files_of_others_stay(ur5, tmp_path):
    (tmp_path / "p.c").write_text("int mine;\n")
    with pytest.raises(OutputError, match="--force"):
        ksl.generate(ur5, ["mass_matrix"], tmp_path, name="p")
    assert (tmp_path / "p.c").read_text() == "int mine;\n" and len(list(tmp_path.iterdir())) == 1
    ksl.generate(ur5, ["mass_matrix"], tmp_path, name="p", force=True)
    ksl.generate(ur5, ["mass_matrix"], tmp_path, name="p")  # its own
    ksl.generate(ur5, ["mass_matrix"], tmp_path / "long", name="p" * 31)


SMALL = {"pendulum": "revolute", "slider": "prismatic", "ball": "spherical"}


@pytest.mark.parametrize("robot", SMALL)
def test_small_robots_are_as_they_were(robot, tmp_path):
    """Text that can be read: a change of it is looked at."""
    builder = ksl.Builder(robot).add_link("base").add_link("bar", 2.0, (0.0, 0.0, -0.5), np.diag([0.2, 0.2, 0.01]))
    builder.add_joint("joint", SMALL[robot], "base", "bar", **({} if robot == "ball" else {"axis": (0, 1, 0)}))
    ksl.generate(builder.build(), ["inverse_dynamics"], tmp_path, name=robot)
    kept = Path(__file__).parent / "small" / f"{robot}.c.txt"
    text = (tmp_path / f"{robot}.c").read_text()
    body = text[text.index(f"void {robot}_inverse_dynamics") :]
    assert body == kept.read_text(), f"differs from {kept.name}"
    header, readme = (tmp_path / f"{robot}.h").read_text(), (tmp_path / "README.md").read_text()
    counts = [len(re.findall(pattern, body)) for pattern in (" [-+*/] ", "_sine_cosine", " / ", "sqrt")]
    assert f" {counts[0]} operations" in header and f"_inverse_dynamics` | {' | '.join(map(str, counts))} | " in readme
    assert ("| 2 | joint.wz |" in readme) == (robot == "ball") and "library computes one state of so large" not in readme
