"""Every kind of joint on a tree against results of Kane's equations at 420 bits.  README.md has the conventions."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

import ksl

CASE = json.loads((Path(__file__).parent / "kinds_a.json").read_text())
JOINTS = {j["name"]: j for j in CASE["joints"]}
TOLERANCE = 1e-12


def words(x) -> str:
    return " ".join(repr(float(v)) for v in x)


def link_text(b: dict) -> str:
    I = b["inertia_about_com"]
    tensor = " ".join(f'i{"xyz"[i]}{"xyz"[k]}="{I[i][k]!r}"' for i in range(3) for k in range(i, 3))
    return f'<link name="{b["name"]}"><inertial><origin xyz="{words(b["com"])}"/><mass value="{b["mass"]!r}"/><inertia {tensor}/></inertial></link>'


def joint_text(j: dict) -> str:
    R = np.array(j["parent_R"])
    rpy = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])), np.arctan2(R[1, 0], R[0, 0])
    kind = "floating" if j["type"] == "free" else j["type"]
    axes = "".join(f'<{tag} xyz="{words(j[tag])}"/>' for tag in ("axis", "axis2") if j[tag])
    if kind == "planar":
        axes = '<axis xyz="0 0 1"/>'
    if j["pitch"]:
        axes += f'<screw_thread_pitch value="{float(j["pitch"] * 2 * np.pi)!r}"/>'
    ends = f'<parent link="{j["parent"]}"/><child link="{j["child"]}"/>'
    return f'<joint name="{j["name"]}" type="{kind}"><origin xyz="{words(j["parent_p"])}" rpy="{words(rpy)}"/>{ends}{axes}</joint>'


@pytest.fixture(scope="module")
def m(tmp_path_factory) -> ksl.Model:
    path = tmp_path_factory.mktemp("kinds") / "kinds.urdf"
    path.write_text("\n".join(['<robot name="kinds">', '<link name="world"/>', *map(link_text, CASE["bodies"]), *map(joint_text, CASE["joints"]), "</robot>"]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)  # types beyond URDF
        return ksl.load(path, gravity=CASE["gravity"])


class State:
    """A state and its results, in KSL's order of joints."""

    def __init__(self, m: ksl.Model, s: dict) -> None:
        columns = lambda i, n: np.concatenate([np.arange(JOINTS[x][i], JOINTS[x][i] + JOINTS[x][n]) for x in m.joint_names])
        self.in_q, self.in_v, self.s = columns("idx_q", "nq"), columns("idx_v", "nv"), {k: np.asarray(x, float) for k, x in s.items()}
        self.motion = self.q, self.v, self.a = self.s["q"][self.in_q], self.of_v("v"), self.of_v("a")

    def of_v(self, key: str) -> np.ndarray:
        return self.s[key][self.in_v]


@pytest.fixture(params=CASE["states"], ids=["first", "second"])
def s(request, m) -> State:
    return State(m, request.param)


def check(found, expected, tolerance=TOLERANCE) -> None:
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() < tolerance * max(1.0, np.abs(expected).max())


def test_the_kinds_are_those_of_the_case(m):
    assert (m.nq, m.nv) == (CASE["nq"], CASE["nv"])
    for j in m.joints:
        if j.name == "base":
            continue
        case = JOINTS[j.name]
        assert (j.kind, j.nq, j.nv) == (case["type"].replace("free", "floating"), case["nq"], case["nv"])
        assert j.axis2 == (pytest.approx(case["axis2"], abs=1e-15) if case["axis2"] else None)
        assert list(j.axis) == pytest.approx(case["axis"] or ([0, 0, 1] if j.kind == "planar" else [0, 0, 0]), abs=1e-15)


def test_efforts(m, s):
    check(m.inverse_dynamics(*s.motion), s.of_v("effort"))
    check(m.inverse_dynamics(s.q, s.v, 0 * s.a), s.of_v("bias"))
    check(m.inverse_dynamics(s.q, 0 * s.v, 0 * s.a), s.of_v("gravity_effort"))
    external = {j["child"]: w for j, w in zip(CASE["joints"], s.s["external"])}
    check(m.inverse_dynamics(*s.motion, external), s.of_v("effort_with_external"))


def test_mass_matrix_and_accelerations(m, s):
    check(m.mass_matrix(s.q), s.s["mass_matrix"][np.ix_(s.in_v, s.in_v)])
    check(m.forward_dynamics(s.q, s.v, s.of_v("applied_effort")), s.of_v("forward_acceleration"), 1e-10)  # condition 4e3


def test_reactions(m, s):
    check(m.reactions(*s.motion, joints=list(JOINTS)), s.s["wrench"])
    held, driven = (m.reactions(*s.motion, joints=list(JOINTS), part=part) for part in ("constraint", "actuation"))
    check(held + driven, s.s["wrench"])


def test_poses_velocities_and_energies(m, s):
    poses = m.frame_poses(s.q, [j["child"] for j in CASE["joints"]])
    check(poses[:, :3, :3], s.s["body_R"])
    check(poses[:, :3, 3], s.s["body_p"])
    check([m.jacobian(s.q, j["child"], axes="frame", at="frame") @ s.v for j in CASE["joints"]], s.s["body_velocity"])
    check(m.energy(s.q, s.v), [s.s["kinetic_energy"], s.s["potential_energy"]])


def test_single_precision(m, s):
    single = [x.astype(np.float32) for x in s.motion]
    check(m.inverse_dynamics(*single), s.of_v("effort"), 1e-5)
    check(m.reactions(*single, joints=list(JOINTS)), s.s["wrench"], 1e-5)
