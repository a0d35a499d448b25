"""MJCF files, read through the package `mujoco`, and states in MuJoCo's layout.

`ksl.load` reads MJCF: MuJoCo's compiler resolves defaults and computes inertias from geometry, and its result becomes a model. :func:`to_mujoco` and
:func:`from_mujoco` convert positions, velocities, accelerations and efforts, which differ for free and planar joints and for quaternions.
"""

from __future__ import annotations

import importlib.util
import os
import re
import warnings
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.base.errors import DescriptionError, DescriptionWarning
from ksl.base.files_read import InputFile
from ksl.base.rotations import quaternion_of, quaternion_product
from ksl.model.builder import Builder, core_of_builder
from ksl.mechanism.core_sentences import with_file
from ksl.mechanism.joint_kinds import KINDS, Kind
from ksl.robot_files.mjcf_compiler import Refused, compiled
from ksl.robot_files.mjcf_files import FilesOfMjcf
from ksl.robot_files.mjcf_frames import matrix, moved
from ksl.robot_files.mjcf_frames import pose as frame
from ksl.robot_files.mjcf_actuators import actuated, actuator_count, added, effort_ranges, led, limit_of
from ksl.robot_files.mjcf_loops import (
    KINDS_OF_EQUALITY,
    Coupling,
    check_kinds,
    closures,
    common_name,
    coupled_joints,
    couplings,
    drives,
    handles,
    is_active,
    is_of_handle,
    name_of,
)
from ksl.robot_files.mjcf_tendons import add_force_elements
from ksl.robot_files.read_options import ReadOptions
from ksl.model.model import Layout, Model, layout_of
from ksl.mechanism.requests import core_of, one_of
from ksl.mechanism.states import in_order

Array = NDArray[np.float64]

FREE, BALL, SLIDE, HINGE = range(4)
"""Values of mjtJoint, which MuJoCo publishes."""
OF_MUJOCO = {FREE: KINDS["floating"], BALL: KINDS["spherical"], SLIDE: KINDS["prismatic"], HINGE: KINDS["revolute"]}
"""Kinds of joints that are those of MuJoCo."""
GRAVITY_DISABLED = 1 << 7
"""The bit of mjtDisableBit that turns gravity off."""
CLOSE = 1e-12
"""Axes and positions that differ less are the same: MuJoCo's compiler normalises axes."""


class MujocoState(NamedTuple):
    """A state in MuJoCo's layout, or in KSL's; None for what was not given."""

    q: Array
    v: Array | None
    a: Array | None
    tau: Array | None


def to_mujoco(model: Model, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, tau: ArrayLike | None = None) -> MujocoState:
    """qpos (…, nq), qvel (…, nv), qacc (…, nv) and forces (…, nv) in MuJoCo's layout, for a model that was read from MJCF.

    q (…, nq), v, a and tau (…, nv): as KSL has them.  They differ from MuJoCo's where a joint is

    * free: MuJoCo's position is that of the body in the world, KSL's is relative to the pose that the file gives the body; MuJoCo's
      linear velocity, its derivative and the force are in world axes, KSL's in the body's;
    * a ball: the quaternion is [w x y z] in MuJoCo, [x y z w] in KSL;
    * planar: MuJoCo's velocity is along the parent's axes, KSL's along the child's;
    * cylindrical: the order is the file's in MuJoCo, angle and travel in KSL;
    * a follower (an equality constraint of two joints): KSL has no numbers for it.  Its force in MuJoCo's layout is zero, since the effort of its
      leader holds both.
    """
    return _converted(model, True, q, v, a, tau)


def from_mujoco(model: Model, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, tau: ArrayLike | None = None) -> MujocoState:
    """The inverse of :func:`to_mujoco`: from qpos (…, nq), qvel, qacc and forces (…, nv) to KSL's q, v, a and tau."""
    return _converted(model, False, q, v, a, tau)


def model_of(
    mj: Any,
    file: str = "",
    mimic: Literal["coupled", "independent"] = "coupled",
    strict: bool = False,
    masses: Literal["optional"] | None = None,
    loops: Literal["cut"] | None = None,
) -> Model:
    """The model of a compiled `mujoco.MjModel`.

    mimic, strict, masses, loops: as in :func:`ksl.load`.  file: what messages call it; nothing is read.  Raises :class:`ksl.DescriptionError`.
    """
    if not (hasattr(mj, "nbody") and hasattr(mj, "nq")):
        raise ValueError(f"mj is {type(mj).__name__}; expected a mujoco.MjModel, for example MjModel.from_xml_path(file)")
    if loops is not None:
        one_of(loops, "loops", "cut")
    model = _model(mj, file, ReadOptions(mimic=mimic, strict=strict, masses=masses, loops=loops), [])
    for line in model.warnings:
        warnings.warn(line, DescriptionWarning, stacklevel=2)
    return model


def _load(file: str, text: bytes | None, contents: bytes, options: ReadOptions) -> Model:
    if importlib.util.find_spec("mujoco") is None:
        raise DescriptionError(f"{file}: this is MJCF, which is read by the package mujoco; install it with: pip install 'ksl[mjcf]'")
    if text is None and not _is_utf_8(file):
        readable = os.fsencode(file).decode("utf-8", "backslashreplace")
        raise DescriptionError(f"{readable}: MuJoCo reads only paths in UTF-8; rename the file or its folder")
    said: list[str] = []
    files = FilesOfMjcf(file, contents, text is not None)
    try:
        mj = compiled(
            os.fspath(file), None if text is None else text.decode("utf-8", "replace"), lambda line: said.append(f"MuJoCo's compiler says: {_one_line(line)}")
        )
    except Refused as e:
        raise DescriptionError(f"{file}: MuJoCo's compiler refuses the file: {_one_line(e)}; correct it there") from None
    return _model(mj, file, options, said, files.inputs(DescriptionError))


def _is_utf_8(path: str) -> bool:
    try:
        path.encode()
    except UnicodeEncodeError:
        return False
    return True


def _model(mj: Any, file: str, options: ReadOptions, said: list[str], inputs: tuple[InputFile, ...] = ()) -> Model:
    try:
        with np.errstate(all="ignore"):  # numbers beyond the range, which the builder refuses
            reader = _Reader(mj, options.mimic_independent, options.cut_loops)
            core_of_builder(reader.builder).read_from(file, reader.unused_lines(), [*said, *reader.said])
            if options.floating_base and not (mj.jnt_type == FREE).any():
                raise DescriptionError("a floating base is asked for, but no body has a <freejoint>; add one, or don't ask for that")
            core = core_of_builder(reader.builder).build(False, *options.of_builder())
    except ValueError as e:
        fault = ValueError("a name in it is not UTF-8; save the file in UTF-8, or give other names") if isinstance(e, UnicodeDecodeError) else e
        raise DescriptionError(with_file(file, fault)) from None
    return Model(core, layout=reader.layout, inputs=inputs, payloads=options.carried)


class _Reader:
    """Bodies, joints and sites of a compiled MuJoCo model as links and joints."""

    def __init__(self, mj: Any, independent: bool, cut: bool) -> None:
        self.mj, self.cut = mj, cut
        self.said: list[str] = []
        self.layout: dict[str, Any] = {"nq": int(mj.nq), "nv": int(mj.nv), "joints": {}}
        gravity = np.zeros(3) if mj.opt.disableflags & GRAVITY_DISABLED else mj.opt.gravity
        self.builder = Builder(bytes(mj.names).split(b"\0", 1)[0].decode() or "mujoco", gravity=tuple(map(float, gravity)))
        self.names: dict[str, set[str]] = {"link": set(), "joint": set()}
        self.unused: dict[str, list[str]] = {}
        self.carried: set[int] = set()
        """Equality constraints that the model has."""
        self.coupled = {j for i in range(mj.neq) for j in coupled_joints(mj, i)}
        self.bodies = [self.new("link", mj.body(i).name or ("world" if i == 0 else f"body{i}")) for i in range(mj.nbody)]
        self.joints = [self.new("joint", mj.joint(i).name or f"{self.bodies[mj.jnt_bodyid[i]]}_joint") for i in range(mj.njnt)]
        self.held: dict[int, float] = {}
        """Joints that equality constraints hold, and where."""
        self.followers: dict[int, Coupling] = {} if independent else couplings(mj, self.joints, self.carried, self.held)
        self.handles = handles(mj)
        if not cut:
            check_kinds(mj)
        self.closures = [] if cut else closures(mj, self.carried, self.handles, self.said.append)
        self.driven = {j for i in range(actuator_count(mj)) for j in actuated(mj, i)} - set(self.held)
        self.efforts = self.effort_limits()
        self.own = {what: getattr(mj, f"dof_{what}") + added(mj, what) for what in ("damping", "armature")} | {"frictionloss": mj.dof_frictionloss}
        """Damping, armature and friction of each coordinate, with what actuators add."""
        self.builder.add_link(self.bodies[0])
        for i in range(1, mj.nbody):
            if i not in self.handles:
                self.add_body(i)
        self.say_handles()
        self.add_sites()
        self.add_loops()
        self.force_elements, self.of_tendons = add_force_elements(self.builder, mj, self.bodies, self.joints, self.handles, self.said.append)

    def new(self, of: str, name: str) -> str:
        """A name that no other link or joint has."""
        while name in self.names[of]:
            name += "_"
        self.names[of].add(name)
        return name

    def add_body(self, i: int) -> None:
        mj, R = self.mj, matrix(self.mj.body_iquat[i])
        self.builder.add_link(self.bodies[i], float(mj.body_mass[i]), mj.body_ipos[i], _symmetric((R * mj.body_inertia[i]) @ R.T))
        parent, pose = self.bodies[mj.body_parentid[i]], frame(mj.body_quat[i], mj.body_pos[i])
        joints = list(range(mj.body_jntadr[i], mj.body_jntadr[i] + mj.body_jntnum[i]))
        if not joints:
            self.weld(self.bodies[i], parent, pose)
        elif (kind := self.kind_of(joints)) is not None:
            self.add_joint_of_kind(kind, joints, parent, i, pose)
        else:
            self.add_chain(joints, parent, i, pose)

    def weld(self, link: str, parent: str, pose: Array) -> None:
        self.builder.add_joint(self.new("joint", f"{link}_joint"), "fixed", parent, link, pose)

    def kind_of(self, joints: list[int]) -> Kind | None:
        """The kind of several joints in one body that has exactly their motion and all that is said of them; None otherwise."""
        mj = self.mj
        types = [int(mj.jnt_type[j]) for j in joints]
        if len(joints) == 1 or any(t in (FREE, BALL) for t in types):
            return None
        qs, vs = [mj.jnt_qposadr[j] for j in joints], [mj.jnt_dofadr[j] for j in joints]
        moved = np.abs([mj.jnt_pos[j] for j, t in zip(joints, types) if t == HINGE]).max(initial=0.0) > CLOSE
        # a kind has neither limits nor springs of single coordinates, and one number for the losses of all, which are of one unit
        named = any(mj.jnt_limited[j] or j in self.efforts or mj.jnt_stiffness[j] or j in self.coupled for j in joints)
        mixed = len(set(types)) > 1
        named = named or (bool(self.closures) and 0 < len(self.driven.intersection(joints)) < len(joints))  # motors move whole joints
        unequal = any(x[vs].any() if mixed else np.ptp(x[vs]) for x in self.own.values())
        if moved or named or unequal or mj.qpos0[qs].any():
            return None
        axes = np.array([mj.jnt_axis[j] for j in joints])
        if types == [HINGE, HINGE]:
            return "universal" if np.linalg.norm(np.cross(*axes)) > 1e-6 else None
        if sorted(types) == [SLIDE, HINGE]:
            return "cylindrical" if np.abs(axes[0] - axes[1]).max() < CLOSE else None
        if len(joints) != 3 or np.abs(axes - np.eye(3)).max() > CLOSE:
            return None
        if types == [SLIDE, SLIDE, SLIDE]:
            return "translation"
        return "planar" if types == [SLIDE, SLIDE, HINGE] else None

    def add_joint_of_kind(self, kind: Kind, joints: list[int], parent: str, body: int, pose: Array) -> None:
        mj, names = self.mj, [self.joints[j] for j in joints]
        if kind == "cylindrical":  # angle, then travel
            joints = sorted(joints, key=lambda j: -int(mj.jnt_type[j]))
        row = KINDS[kind]
        axes = [name for name, is_needed in (("axis", row.has_axis), ("axis2", row.has_axis2)) if is_needed]
        given_axes = {name: mj.jnt_axis[j] for name, j in zip(axes, joints)}
        if kind == "planar":  # its axis is the normal, that of the third joint
            given_axes = {"axis": np.array([0.0, 0.0, 1.0])}
        name = self.new("joint", _common_name(names))
        self.builder.add_joint(name, kind, parent, self.bodies[body], pose, **given_axes, **self.losses(joints[0]))
        self.note(name, kind, joints)

    def add_chain(self, joints: list[int], parent: str, body: int, pose: Array) -> None:
        """One joint after the other, with massless links between them.

        `pose` is that of the body, as far as it is carried, in `parent`.  Joints act in the body's frame: T(pos) J(q) T(−pos).
        """
        mj = self.mj
        for j in joints:
            kind, name = int(mj.jnt_type[j]), self.joints[j]
            at = mj.jnt_pos[j] if kind in (HINGE, BALL) else np.zeros(3)
            is_body = j == joints[-1] and np.abs(at).max() <= CLOSE
            child = self.bodies[body] if is_body else self.new("link", f"{name}_frame")
            if not is_body:
                self.builder.add_link(child)
            placement = pose @ moved(at) @ self.motion_of(j, kind, -self.reference(j, kind))
            if j in self.held:
                self.builder.add_joint(name, "fixed", parent, child, placement @ self.motion_of(j, kind, self.held[j]))
                self.layout.setdefault("held", []).append([int(mj.jnt_qposadr[j]), int(mj.jnt_dofadr[j]), self.held[j]])
                self.not_carried(f"held at {self.held[j]:.6g} by an equality constraint, and fixed there; range, spring, losses and motors", name)
                parent, pose = child, moved(-at)
                continue
            self.builder.add_joint(name, cast("Kind", OF_MUJOCO[kind].name), parent, child, placement, **self.numbers_of(j, kind))
            self.note(name, ("free", "ball", "plain", "plain")[kind], [j], placement)
            parent, pose = child, moved(-at)
        if parent != self.bodies[body]:
            self.weld(self.bodies[body], parent, pose)

    def reference(self, j: int, kind: int) -> float:
        """MuJoCo's position where the body is as the file has it."""
        return float(self.mj.qpos0[self.mj.jnt_qposadr[j]]) if kind in (SLIDE, HINGE) else 0.0

    def motion_of(self, j: int, kind: int, q: float) -> Array:
        if q == 0.0:
            return np.eye(4)
        if kind == SLIDE:
            return moved(q * self.mj.jnt_axis[j])
        return frame(np.array([np.cos(q / 2), *(np.sin(q / 2) * self.mj.jnt_axis[j])]), np.zeros(3))

    def effort_limits(self) -> dict[int, float]:
        """The largest effort of each joint that has motors or a range of forces, those of its followers included."""
        number = {name: j for j, name in enumerate(self.joints)}
        family = {}
        for j in self.followers:
            leader, multiplier = j, 1.0
            while leader in self.followers:
                multiplier *= self.followers[leader][1]
                leader = number[self.followers[leader][0]]
            family[j] = (leader, multiplier)
        found = {}
        for j, own in led({j: own for j, own in effort_ranges(self.mj).items() if j not in self.held}, family).items():
            if (limit := limit_of(own)) is not None:
                found[j] = limit
                if -own[0] != own[1]:
                    self.not_carried(f"unequal efforts, {own[0]:.6g} to {own[1]:.6g}; the limit is {limit:.6g} both ways, and the rest", self.joints[j])
        return found

    def say_handles(self) -> None:
        """Mocap bodies, and what welds the robot to them, which would make a rigid structure of it."""
        if not self.handles:
            return
        names = [name_of(self.mj, i) for i in range(self.mj.neq) if is_of_handle(self.mj, i, self.handles)]
        ties = f", with equality constraint {', '.join(names)}" if names else ""
        some = [self.bodies[i] for i in sorted(self.handles)]
        self.said.append(f"mocap body {', '.join(some)}: a handle by which a simulator moves the robot, and no part of it; left out{ties}")

    def numbers_of(self, j: int, kind: int) -> dict[str, Any]:
        mj, numbers = self.mj, self.losses(j)
        if kind in (SLIDE, HINGE):
            numbers["axis"] = mj.jnt_axis[j]
            numbers["mimic"] = self.followers.get(j)
            numbers["spring_stiffness"] = float(mj.jnt_stiffness[j])
            numbers["spring_rest"] = float(mj.qpos_spring[mj.jnt_qposadr[j]])
            if mj.jnt_limited[j]:
                numbers["limits"] = tuple(map(float, mj.jnt_range[j]))
            if j in self.efforts:
                numbers["effort"] = self.efforts[j]
        else:
            if mj.jnt_limited[j]:
                self.not_carried("range of a ball", self.joints[j])
            if mj.jnt_stiffness[j]:
                self.not_carried("stiffness", self.joints[j])
        return numbers

    def losses(self, j: int) -> dict[str, Any]:
        """Damping, friction and armature, the same for all coordinates of the joint."""
        mj, name, numbers = self.mj, self.joints[j], {}
        v = slice(int(mj.jnt_dofadr[j]), int(mj.jnt_dofadr[j]) + OF_MUJOCO[int(mj.jnt_type[j])].nv)
        for ours, theirs in (("damping", "damping"), ("friction", "frictionloss"), ("armature", "armature")):
            values = self.own[theirs][v]
            if ours == "armature" and values.any() and int(mj.jnt_type[j]) == FREE:  # mostly that of a default class
                self.not_carried("armature of a free joint", name)
            elif values.any() and np.ptp(values):
                self.not_carried(f"{theirs}, unequal", name)
            elif values.any():
                numbers[ours] = float(values[0])
        return numbers

    def note(self, name: str, kind: str, joints: list[int], placement: Array | None = None) -> None:
        """Where MuJoCo has the numbers of a joint."""
        q, v = self.mj.jnt_qposadr, self.mj.jnt_dofadr
        rows = [(j, OF_MUJOCO[int(self.mj.jnt_type[j])]) for j in joints]
        entry: dict[str, Any] = {
            "kind": kind,
            "q": [int(q[j]) + i for j, row in rows for i in range(row.nq)],
            "v": [int(v[j]) + i for j, row in rows for i in range(row.nv)],
        }
        if kind == "free" and placement is not None:
            entry["placement"] = placement.tolist()
        self.layout["joints"][name] = entry

    def add_sites(self) -> None:
        """Named sites are MuJoCo's frames."""
        mj = self.mj
        for i in range(mj.nsite):
            if (name := mj.site(i).name) and int(mj.site_bodyid[i]) not in self.handles:
                link = self.new("link", name if name not in self.names["link"] else f"{name}_site")
                self.builder.add_link(link)
                self.weld(link, self.bodies[mj.site_bodyid[i]], frame(mj.site_quat[i], mj.site_pos[i]))

    def add_loops(self) -> None:
        for closure in self.closures:
            predecessor, successor = (self.bodies[b] for b in closure.bodies)
            name = self.new("joint", common_name(closure.names) or f"{predecessor}_{successor}_loop")
            self.builder.add_loop(name, cast("Kind", closure.kind), predecessor, successor, closure.predecessor_pose, closure.successor_pose, axis=closure.axis)
        places = {q: name for name, entry in self.layout["joints"].items() for q in entry["q"]}
        names = {j: places[int(self.mj.jnt_qposadr[j])] for j in self.driven}
        leader = {self.joints[j]: coupling[0] for j, coupling in self.followers.items()}
        floats = {self.joints[j] for j in range(self.mj.njnt) if self.mj.jnt_type[j] == FREE}
        found, self.other_actuators = drives(self.mj, names, leader, floats)
        if found:
            core_of_builder(self.builder).set_drives(found, [])

    def not_carried(self, what: str, joint: str) -> None:
        self.unused.setdefault(what, []).append(joint)

    def unused_lines(self) -> list[str]:
        mj = self.mj
        lines = [f"joint {', '.join(names)}: {what} (not used)" for what, names in self.unused.items()]
        for what in ("dof_dampingpoly", "jnt_stiffnesspoly"):
            if np.any(getattr(mj, what, 0)):
                lines.append(f"{what.partition('_')[2]} (nonlinear terms are not used)")
        if mj.body_gravcomp.any():
            lines.append(f"gravcomp ({np.count_nonzero(mj.body_gravcomp)} bodies; gravity acts on them in full)")
        if bases := sum(1 for i in range(mj.nbody) if mj.body_mocapid[i] >= 0 and i not in self.handles):
            lines.append(f"mocap bodies ({bases}; welded where the file has them)")
        if mj.opt.density or mj.opt.viscosity:
            lines.append("density, viscosity (no forces of a fluid)")
        lines += self.equality_lines() + self.of_tendons
        for word, count in (
            ("geom", mj.ngeom), ("actuator", self.other_actuators if self.closures else actuator_count(mj)), ("tendon", mj.ntendon - self.force_elements), ("sensor", mj.nsensor), ("contact pair", mj.npair), ("contact exclude", mj.nexclude),
            ("flex", getattr(mj, "nflex", 0)), ("skin", mj.nskin), ("camera", mj.ncam), ("light", mj.nlight), ("keyframe", mj.nkey), ("plugin", mj.nplugin),
        ):  # fmt: skip
            if count:
                lines.append(f"{word} ({count})")
        return lines

    def equality_lines(self) -> list[str]:
        """Constraints that are not closed, and what isn't used of the others."""
        mj, lines = self.mj, []
        left: dict[str, int] = {}
        for i in range(mj.neq):
            if i not in self.carried:
                kind = int(mj.eq_type[i])
                word = KINDS_OF_EQUALITY[kind] if kind < len(KINDS_OF_EQUALITY) else str(kind)
                word += " to a mocap body" if is_of_handle(mj, i, self.handles) else "" if is_active(mj, i) else ", not active"
                left[word] = left.get(word, 0) + 1
        lines += [f"equality {word} ({count})" for word, count in sorted(left.items())]
        if self.closures:
            loops = "1 loop" if len(self.closures) == 1 else f"{len(self.closures)} loops"
            lines.append(f"solref, solimp of equality constraints ({loops}, closed exactly)")
        return lines


def _one_line(text: object) -> str:
    return " ".join(str(text).split())


def _common_name(names: list[str]) -> str:
    """hip of hip_x and hip_y; a+b of names that have no word in common."""
    common = os.path.commonprefix(names)  # noqa: RUF071 - letters in common are meant, not folders
    word = common.rstrip("_-./ ")
    ends_there = common != word or all(re.fullmatch("[xyzXYZ0-9]?", name[len(common) :]) for name in names)
    return word if word and ends_there else "+".join(names)


def _symmetric(x: Array) -> Array:
    return (x + x.T) / 2


def _converted(model: Model, to: bool, q: ArrayLike, v: ArrayLike | None, a: ArrayLike | None, tau: ArrayLike | None) -> MujocoState:
    layout = layout_of(model)
    if layout is None:
        raise ValueError(f"{model.name}: the model has no layout of MuJoCo: it was not read from MJCF, or was made from one that was")
    sizes = (layout["nq"], layout["nv"]) if not to else (model.nq, model.nv)

    def rows(x: ArrayLike, n: int, name: str) -> Array:
        return _rows(in_order(x, name, core_of(model)) if to else x, n, name)

    given_q, out_q = rows(q, sizes[0], "q"), (layout["nq"] if to else model.nq)
    out_v = layout["nv"] if to else model.nv
    rates = {name: rows(x, sizes[1], name) for name, x in (("v", v), ("a", a), ("tau", tau)) if x is not None}
    if "a" in rates and "v" not in rates:
        raise ValueError("a is given without v; accelerations of free and planar joints need both")
    leading = np.broadcast_shapes(given_q.shape[:-1], *(x.shape[:-1] for x in rates.values()))
    given_q = np.broadcast_to(given_q, leading + given_q.shape[-1:])
    new_q = np.empty(leading + (out_q,))
    new = {name: np.empty(leading + (out_v,)) for name in rates}
    for joint in model.joints[: len(model.joint_names)]:
        entry = layout["joints"][joint.name]
        own_q, own_v = list(range(joint.q_index, joint.q_index + joint.nq)), list(range(joint.v_index, joint.v_index + joint.nv))
        from_q, to_q, from_v, to_v = (own_q, entry["q"], own_v, entry["v"]) if to else (entry["q"], own_q, entry["v"], own_v)
        position = given_q[..., from_q]
        old = {name: np.broadcast_to(x, leading + x.shape[-1:])[..., from_v] for name, x in rates.items()}
        convert = {"free": _free, "ball": _ball, "planar": _planar}.get(entry["kind"], lambda _e, _to, p, r: (p, r))
        new_q[..., to_q], converted = convert(entry, to, position, old)
        for name, x in converted.items():
            new[name][..., to_v] = x
    for q_index, v_index, at in layout.get("held", []) if to else ():
        new_q[..., q_index] = at
        for x in new.values():
            x[..., v_index] = 0.0
    for name in model.follower_names if to else ():
        follower = model.joint(name)
        leader, entry = model.joint(follower.leader or ""), layout["joints"][name]
        new_q[..., entry["q"]] = follower.multiplier * given_q[..., [leader.q_index]] + follower.offset
        for rate, x in new.items():
            own = np.broadcast_to(rates[rate], leading + (model.nv,))[..., [leader.v_index]]
            x[..., entry["v"]] = 0.0 if rate == "tau" else follower.multiplier * own
    return MujocoState(new_q, new.get("v"), new.get("a"), new.get("tau"))


def _rows(x: ArrayLike, n: int, name: str) -> Array:
    rows = np.asarray(x, dtype=float)
    if rows.ndim == 0 or rows.shape[-1] != n:
        raise ValueError(f"{name} has shape {rows.shape}; expected (…, {n})")
    return rows


_Rates = dict[str, Array]


def _ball(_: Layout, to: bool, q: Array, rates: _Rates) -> tuple[Array, _Rates]:
    return (q[..., [3, 0, 1, 2]] if to else q[..., [1, 2, 3, 0]]), rates


def _free(entry: Layout, to: bool, q: Array, rates: _Rates) -> tuple[Array, _Rates]:
    """KSL: pose in the joint's frame, quaternion last, linear velocity in the body's axes; MuJoCo: in the world's, quaternion first."""
    placement = np.array(entry["placement"])
    R, t = placement[:3, :3], placement[:3, 3]
    turn = quaternion_of(R)
    if to:
        own = q[..., 3:] / np.linalg.norm(q[..., 3:], axis=-1, keepdims=True)
        wxyz = quaternion_product(turn, own)[..., [3, 0, 1, 2]]
        new_q = np.concatenate([q[..., :3] @ R.T + t, wxyz], axis=-1)
    else:
        wxyz = q[..., 3:] / np.linalg.norm(q[..., 3:], axis=-1, keepdims=True)
        own = quaternion_product(turn * [-1, -1, -1, 1], wxyz[..., [1, 2, 3, 0]])
        new_q = np.concatenate([(q[..., :3] - t) @ R, own], axis=-1)
    x, y, z, w = np.moveaxis(wxyz[..., [1, 2, 3, 0]], -1, 0)
    u, w = np.stack([x, y, z], axis=-1), w[..., None]

    def turned(p: Array, sign: float) -> Array:
        """Into world axes, or back with sign −1."""
        c = 2 * np.cross(u, p)
        return np.asarray(p + sign * w * c + np.cross(u, c))

    return new_q, _linear_parts(to, rates, lambda p: turned(p, 1.0), lambda p: turned(p, -1.0), lambda r: r[..., 3:], 3)


def _planar(_: Layout, to: bool, q: Array, rates: _Rates) -> tuple[Array, _Rates]:
    c, s = np.cos(q[..., 2]), np.sin(q[..., 2])

    def turned(p: Array, sign: float) -> Array:
        x, y = p[..., 0], p[..., 1]
        return np.stack([c * x - sign * s * y, sign * s * x + c * y], axis=-1)

    return q, _linear_parts(to, rates, lambda p: turned(p, 1.0), lambda p: turned(p, -1.0), lambda r: r[..., 2:], 2)


def _linear_parts(to: bool, rates: _Rates, out: Any, back: Any, angular: Any, n: int) -> _Rates:
    """The first n numbers from the child's axes to those that stand (`out`), or `back`; those after them are the same.

    With R the child's axes: v' = R v, a' = R (a + ω × v), and forces as velocities.
    """

    def spin(v: Array) -> Array:
        """ω × v in the child's axes."""
        linear, w = v[..., :n], angular(v)
        if n == 3:
            return np.cross(w, linear)
        return np.stack([-w[..., 0] * linear[..., 1], w[..., 0] * linear[..., 0]], axis=-1)

    new = {}
    for name, x in rates.items():
        linear = x[..., :n]
        if name == "a" and to:
            linear = out(linear + spin(rates["v"]))
        elif name == "a":
            own_v = np.concatenate([back(rates["v"][..., :n]), angular(rates["v"])], axis=-1)
            linear = back(linear) - spin(own_v)
        else:
            linear = out(linear) if to else back(linear)
        new[name] = np.concatenate([linear, x[..., n:]], axis=-1)
    return new
