"""Random mechanisms as URDF text, and random states for them."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import numpy as np

import ksl
from newton_euler import Tree, newton_euler, read_tree

KINDS = ("revolute", "continuous", "prismatic", "helical", "cylindrical", "universal", "spherical", "planar", "translation", "fixed", "floating")
WITHOUT_AXIS = ("spherical", "translation", "fixed", "floating")
TRAVELS = {"prismatic": slice(0, 1), "cylindrical": slice(1, 2), "planar": slice(0, 2), "translation": slice(0, 3)}
"""Which numbers of q are lengths."""
EXACT_AXES = [s * np.eye(3)[i] for i in range(3) for s in (1.0, -1.0)]


def words(x) -> str:
    return " ".join(repr(float(v)) for v in np.atleast_1d(x))


def origin(rng: np.random.Generator, size: float = 0.5) -> str:
    """A placement: anywhere, or turned by right angles, or none at all."""
    choice = rng.integers(4)
    if choice == 0:
        return ""
    rpy = rng.uniform(-np.pi, np.pi, 3) if choice > 1 else rng.integers(-2, 3, 3) * np.pi / 2
    return f'<origin xyz="{words(rng.uniform(-size, size, 3))}" rpy="{words(rpy)}"/>'


def inertial(rng: np.random.Generator) -> str:
    """The inertia of four random point masses, hence one that a body can have."""
    if rng.random() < 0.15:
        return ""
    masses, points = rng.uniform(0.1, 1.0, 4), rng.normal(size=(4, 3)) * 0.1
    points -= masses @ points / masses.sum()
    I = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points))
    tensor = " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{float(I[i, j])!r}"' for i in range(3) for j in range(i, 3))
    return f'<inertial>{origin(rng, 0.2)}<mass value="{float(masses.sum())!r}"/><inertia {tensor}/></inertial>'


def second_axis(rng: np.random.Generator, first: np.ndarray) -> np.ndarray:
    """An axis at any angle to the first that is not small, often a right one."""
    while True:
        second = EXACT_AXES[rng.integers(6)] if rng.random() < 0.5 else rng.normal(size=3)
        if np.linalg.norm(np.cross(first, second)) > 0.3 * np.linalg.norm(first) * np.linalg.norm(second):
            return second


def random_tree(rng: np.random.Generator, bodies: int, kinds: tuple[str, ...] = KINDS) -> str:
    """URDF text of a tree of `bodies` links: random placements, inertias and branches; axes exact and arbitrary; joints
    not in the order of links, and named against the alphabet."""
    links = [f'<link name="link{i}">{inertial(rng)}</link>' for i in range(bodies)]
    chances = np.array([1.0 if k == "floating" else 4.0 for k in kinds])
    joints = []
    for i in range(1, bodies):
        parent = i - 1 if rng.random() < 0.6 else int(rng.integers(i))
        kind = str(rng.choice(kinds, p=chances / chances.sum()))
        axis = EXACT_AXES[rng.integers(6)] if rng.random() < 0.5 else rng.normal(size=3)
        axis_text = "" if kind in WITHOUT_AXIS or rng.random() < 0.1 else f'<axis xyz="{words(axis)}"/>'
        if kind == "universal":
            axis_text += f'<axis2 xyz="{words(second_axis(rng, axis if axis_text else EXACT_AXES[0]))}"/>'
        limit = '<limit lower="-9" upper="9" effort="1000" velocity="100"/>' if kind in ("revolute", "prismatic") else ""
        pitch = f'<screw_thread_pitch value="{words(rng.normal() * 0.2)}"/>' if kind == "helical" else ""
        joints.append(
            f'<joint name="joint{bodies - i}" type="{kind}">{origin(rng)}<parent link="link{parent}"/><child link="link{i}"/>{axis_text}{limit}{pitch}</joint>'
        )
    rng.shuffle(joints)
    return "\n".join(['<?xml version="1.0"?>', '<robot name="random">', *links, *joints, "</robot>"])


def load_text(text: str, **options) -> ksl.Model:
    """Writes URDF text to a file and loads it: also one whose links have no mass, where external wrenches are all that acts."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)
        path = Path(folder) / "robot.urdf"
        path.write_text(text)
        return ksl.load(path, masses="optional", **options)


def random_states(m: ksl.Model, rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (n, nq) with unit quaternions, v and a (n, nv)."""
    q, v, a = rng.uniform(-np.pi, np.pi, (n, m.nq)), rng.normal(size=(n, m.nv)), rng.normal(size=(n, m.nv))
    for j in m.joints:
        if j.kind in ("floating", "spherical"):
            part = q[:, j.q_index + j.nq - 4 : j.q_index + j.nq]
            part[:] = rng.normal(size=(n, 4))
            part /= np.linalg.norm(part, axis=1, keepdims=True)
        if j.kind in TRAVELS and j.nq:  # not one that mimics another
            q[:, j.q_index : j.q_index + j.nq][:, TRAVELS[j.kind]] /= 6
    return q, v, a


def random_external(m: ksl.Model, rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    """Wrenches on about a third of the links."""
    return {name: rng.normal(size=(n, 6)) * 10 for name in m.link_names if rng.random() < 0.3}


def by_joint(m: ksl.Model, x: np.ndarray, start: str, size: str) -> dict[str, np.ndarray]:
    return {j.name: x[..., getattr(j, start) : getattr(j, start) + getattr(j, size)] for j in m.joints if j.nv}


def witness(m: ksl.Model, tree: Tree, q, v, a, external=None):
    """The witness's results at a model's states."""
    floating = any(j.name == "floating_base" for j in m.joints)
    split = by_joint(m, q, "q_index", "nq"), by_joint(m, v, "v_index", "nv"), by_joint(m, a, "v_index", "nv")
    if not m.nv:  # a rigid robot: the states have no numbers, but there are len(q) of them
        split = ({"base": np.zeros((len(q), 0))}, {}, {})
    return newton_euler(tree, *split, external, m.gravity, floating)


class Case:
    """A random robot with random states and external wrenches, and what the witness says of them."""

    def __init__(self, seed: int, bodies: int, states: int = 4, kinds: tuple[str, ...] = KINDS, **options) -> None:
        self.rng = np.random.default_rng(seed)
        self.text = random_tree(self.rng, bodies, kinds)
        self.m = load_text(self.text, **options)
        self.tree = read_tree(self.text)
        self.q, self.v, self.a = self.state = random_states(self.m, self.rng, states)
        self.external = random_external(self.m, self.rng, states)
        self.witness = witness(self.m, self.tree, *self.state, self.external)
        self.names = [j.name for j in self.m.joints]

    def all_reactions(self, **options) -> np.ndarray:
        return self.m.reactions(*self.state, self.external, joints=self.names, **options)

    @property
    def load(self) -> float:
        """The largest number in any wrench: what errors are measured by."""
        return max(1.0, *(float(np.abs(self.witness.in_joint_frame(j.child)).max()) for j in self.m.joints))


def random_poses(rng: np.random.Generator, n: int) -> np.ndarray:
    """(n, 4, 4): anywhere; a quarter turned by right angles, a quarter none at all."""
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, :3] = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    poses[:, :3, :3] *= np.linalg.det(poses[:, :3, :3])[:, None, None]
    poses[:, :3, 3] = rng.uniform(-0.5, 0.5, (n, 3))
    right_angles = np.eye(3)[:, [1, 2, 0]]
    for pose, choice in zip(poses, rng.integers(4, size=n)):
        if choice == 0:
            pose[:] = np.eye(4)
        elif choice == 1:
            pose[:3, :3] = np.linalg.matrix_power(right_angles, int(rng.integers(3)))
    return poses


def random_model(rng: np.random.Generator, bodies: int, kinds: tuple[str, ...] = KINDS, massless: float = 0.15, **options) -> ksl.Model:
    """The same sort of tree from the builder, which takes far less time than a file.  massless: the share of links without mass."""
    b = ksl.Builder("random")
    masses, points = rng.uniform(0.1, 1.0, (bodies, 4)), rng.normal(size=(bodies, 4, 3)) * 0.1
    center = (masses[..., None] * points).sum(axis=1) / masses.sum(axis=1)[:, None]
    arm = points - center[:, None]
    inertia = np.einsum("bp,bpi,bpi->b", masses, arm, arm)[:, None, None] * np.eye(3) - np.einsum("bp,bpi,bpj->bij", masses, arm, arm)
    for i, empty in enumerate(rng.random(bodies) < massless):
        b.add_link(f"link{i}") if empty else b.add_link(f"link{i}", masses[i].sum(), center[i], inertia[i])
    chances = np.array([1.0 if k == "floating" else 4.0 for k in kinds])
    chosen, poses, directions = rng.choice(kinds, size=bodies, p=chances / chances.sum()), random_poses(rng, bodies), rng.normal(size=(bodies, 3))
    for i in range(1, bodies):
        kind, given = str(chosen[i]), {}
        if kind not in WITHOUT_AXIS:
            given["axis"] = EXACT_AXES[rng.integers(6)] if rng.random() < 0.5 else directions[i]
        if kind == "universal":
            given["axis2"] = second_axis(rng, given["axis"])
        if kind == "helical":
            given["pitch"] = rng.normal() * 0.05
        parent = i - 1 if rng.random() < 0.6 else int(rng.integers(i))
        b.add_joint(f"joint{bodies - i}", kind, f"link{parent}", f"link{i}", poses[i], **given)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)
        return b.build(masses="optional", **options)
