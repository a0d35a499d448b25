"""The readers of SDF and MJCF against results of Kane's equations at 420 bits.  README.md has the conventions."""

import json
from pathlib import Path

import numpy as np
import pytest

import ksl

HERE = Path(__file__).parent
TOLERANCE = 1e-12


class Case:
    """The model of a description file, and its reference results in the order of the model's joints."""

    def __init__(self, name: str, file: str) -> None:
        self.m = ksl.load(HERE / file)
        self.case = json.loads((HERE / f"{name}.json").read_text())
        self.by_link = {j["child"]: j for j in self.case["joints"]}
        by_name = {j["name"]: j for j in self.case["joints"]}
        moving = [by_name[name] if name in by_name else self.by_link[self.m.joint(name).child] for name in self.m.joint_names]
        columns = lambda i, n: np.concatenate([np.arange(j[i], j[i] + j[n]) for j in moving])
        self.in_q, self.in_v = columns("idx_q", "nq"), columns("idx_v", "nv")

    def states(self):
        return [{k: np.asarray(x, float) for k, x in s.items()} for s in self.case["states"]]


FILES = {"read_sdf.sdf": "read_sdf", "read_sdf_1_4.sdf": "read_sdf", "read_sdf_1_6.sdf": "read_sdf", "read_mjcf.xml": "read_mjcf"}
"""Description files, and the case that each of them describes.  Joints of the older SDF files have frames of their own."""


@pytest.fixture(scope="module", params=[(case, file) for file, case in FILES.items()], ids=list(FILES))
def case(request) -> Case:
    return Case(*request.param)


def check(found, expected, tolerance=TOLERANCE) -> None:
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() < tolerance * max(1.0, np.abs(expected).max())


def test_links_and_joints_are_those_of_the_case(case):
    m = case.m
    assert (m.nq, m.nv, m.root) == (case.case["nq"], case.case["nv"], "world")
    assert m.warnings == m.unused == ()
    frames = {f"{j['name']}_frame" for j in case.by_link.values() if j["nv"] == 1} if "_1_" in m.file else set()
    assert {link.name for link in m.links} == {"world", *case.by_link, *frames}
    if frames:  # between the joint and its child, which the poses below show
        return
    for j in m.joints[:-1]:
        expected = case.by_link[j.child]
        kind = expected["type"].replace("free", "floating")
        if m.file.endswith(".xml"):
            kind = kind.replace("continuous", "revolute")
        assert (j.kind, j.parent) == (kind, expected["parent"])
        if j.kind != "fixed" or m.file.endswith(".sdf"):  # MJCF has no names for them
            assert j.name == expected["name"]
        for axis in ("axis", "axis2"):
            if expected[axis]:
                check(getattr(j, axis), expected[axis])
        check(j.pitch, expected["pitch"] or 0.0)


def test_dynamics(case):
    m, square = case.m, np.ix_(case.in_v, case.in_v)
    for s in case.states():
        q, v, a = s["q"][case.in_q], s["v"][case.in_v], s["a"][case.in_v]
        external = {j["child"]: w for j, w in zip(case.case["joints"], s["external"])}
        check(m.inverse_dynamics(q, v, a), s["effort"][case.in_v])
        check(m.inverse_dynamics(q, v, a, external), s["effort_with_external"][case.in_v])
        check(m.bias(q, v), s["bias"][case.in_v])
        check(m.gravity_torque(q), s["gravity_effort"][case.in_v])
        check(m.mass_matrix(q), s["mass_matrix"][square])
        check(m.forward_dynamics(q, v, s["applied_effort"][case.in_v]), s["forward_acceleration"][case.in_v], 1e-10)
        check(m.energy(q, v), [s["kinetic_energy"], s["potential_energy"]])


def test_poses_and_reactions(case):
    m, links = case.m, [j["child"] for j in case.case["joints"]]
    for s in case.states():
        q, v, a = s["q"][case.in_q], s["v"][case.in_v], s["a"][case.in_v]
        poses = m.frame_poses(q, links)
        check(poses[:, :3, :3], s["body_R"])
        check(poses[:, :3, 3], s["body_p"])
        check(m.reactions(q, v, a, joints=[m.joint_above(link).name for link in links]), s["wrench"])


def words(x) -> str:
    return " ".join(repr(float(v)) for v in x)


def random_pose(rng: np.random.Generator) -> np.ndarray:
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Q * np.linalg.det(Q), rng.normal(size=3)
    return pose


def pose_text(rng: np.random.Generator, pose: np.ndarray, relative_to: str) -> str:
    """A pose in one of the forms that SDF 1.9 has."""
    R, relative = pose[:3, :3], f' relative_to="{relative_to}"' if relative_to else ""
    rpy = np.array([np.arctan2(R[2, 1], R[2, 2]), np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])), np.arctan2(R[1, 0], R[0, 0])])
    form = rng.integers(3)
    if form == 0:
        return f"<pose{relative}>{words([*pose[:3, 3], *rpy])}</pose>"
    if form == 1:
        return f'<pose{relative} degrees="true">{words([*pose[:3, 3], *np.degrees(rpy)])}</pose>'
    w = np.sqrt(max(0.0, 1 + np.trace(R))) / 2
    x, y, z = (R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w)
    return f'<pose{relative} rotation_format="quat_xyzw">{words([*pose[:3, 3], x, y, z, w])}</pose>'


def scrambled_sdf(rng: np.random.Generator, case: dict, zero: dict[str, np.ndarray]) -> str:
    """The same mechanism with links' frames anywhere, and each pose and axis in any frame.  `zero`: poses of the case's links at q = 0."""
    model = random_pose(rng)  # in the world
    links = {name: pose @ random_pose(rng) for name, pose in zero.items()}  # the joints stay where the case's links were
    fixed_in_model = {"__model__": model, **links}  # world poses at q = 0
    for i in range(3):
        fixed_in_model[f"frame{i}"] = random_pose(rng)
    inverse = np.linalg.inv
    order = list(fixed_in_model)
    text = [f'<sdf version="1.9"><model name="scrambled">{pose_text(rng, model, "")}']
    for i, (name, pose) in enumerate(fixed_in_model.items()):
        base = order[rng.integers(i)] if i else ""  # one before it, so that there is no cycle
        if name.startswith("frame"):
            text.append(
                f'<frame name="{name}" attached_to="{order[rng.integers(1, len(links))]}">{pose_text(rng, inverse(fixed_in_model[base]) @ pose, base)}</frame>'
            )
    for i, name in enumerate(links, 1):
        base, b = order[rng.integers(i)], next(b for b in case["bodies"] if b["name"] == name)
        com = np.eye(4)
        com[:3, 3] = b["com"]
        turn = random_pose(rng)
        turn[:3, 3] = 0.0
        turned = inverse(links[name]) @ zero[name] @ com @ turn
        I = turn[:3, :3].T @ np.array(b["inertia_about_com"]) @ turn[:3, :3]
        tensor = "".join(f"<i{'xyz'[r]}{'xyz'[c]}>{float(I[r, c])!r}</i{'xyz'[r]}{'xyz'[c]}>" for r in range(3) for c in range(r, 3))
        text.append(
            f'<link name="{name}">{pose_text(rng, inverse(fixed_in_model[base]) @ links[name], base)}'
            f"<inertial>{pose_text(rng, turned, '')}<mass>{b['mass']!r}</mass><inertia>{tensor}</inertia></inertial></link>"
        )
    types = {"helical": "screw", "spherical": "ball"}
    for j in case["joints"]:
        base, seen_from = order[rng.integers(len(order))], order[rng.integers(len(order))]
        R = inverse(fixed_in_model[seen_from])[:3, :3] @ zero[j["child"]][:3, :3]
        axes = "".join(f'<{tag}><xyz expressed_in="{seen_from}">{words(R @ j[tag])}</xyz></{tag}>' for tag in ("axis", "axis2") if j[tag])
        pitch = f"<thread_pitch>{-1 / j['pitch']!r}</thread_pitch>" if j["pitch"] else ""
        text.append(
            f'<joint name="{j["name"]}" type="{types.get(j["type"], j["type"])}"><parent>{j["parent"]}</parent><child>{j["child"]}</child>'
            f"{pose_text(rng, inverse(fixed_in_model[base]) @ zero[j['child']], base)}{axes}{pitch}</joint>"
        )
    return "".join([*text, "</model></sdf>"])


@pytest.mark.parametrize("seed", range(8))
def test_the_same_mechanism_in_other_frames(tmp_path, seed):
    plain = Case("read_sdf", "read_sdf.sdf")
    neutral = np.array([float(joint.quaternion is not None and i == joint.quaternion + 3) for joint in plain.m.joints for i in range(joint.nq)])
    names = list(plain.by_link)
    zero = dict(zip(names, plain.m.frame_poses(neutral, names)))
    path = tmp_path / "scrambled.sdf"
    path.write_text(scrambled_sdf(np.random.default_rng(seed), plain.case, zero))
    m = ksl.load(path)
    assert sorted(m.joint_names) == sorted(plain.m.joint_names)
    by_name = {j["name"]: j for j in plain.case["joints"]}
    columns = lambda i, n: np.concatenate([np.arange(by_name[x][i], by_name[x][i] + by_name[x][n]) for x in m.joint_names])
    in_q, in_v = columns("idx_q", "nq"), columns("idx_v", "nv")
    for s in plain.states():
        motion = s["q"][in_q], s["v"][in_v], s["a"][in_v]
        check(m.inverse_dynamics(*motion), s["effort"][in_v])
        check(m.mass_matrix(motion[0]), s["mass_matrix"][np.ix_(in_v, in_v)])
        check(m.reactions(*motion, joints=list(by_name)), s["wrench"])  # at the joints, in their frames
