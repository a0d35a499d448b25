"""The robot in MuJoCo: MJCF, and URDF as MuJoCo's compiler reads it."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np

from ksl.comparison import coordinates
from ksl.comparison.bodies import pseudo_inertia
from ksl.comparison.coordinates import Array, Mapped
from ksl.comparison.other_robot import said_by, File, NotLoaded, OneState, OtherRobot, Place, check_root
from ksl.comparison.results import Note
from ksl.comparison.urdf_text import on_floating_joint, text, without
from ksl.mechanism.mechanism import Joint
from ksl.robot_files.load_mjcf import OF_MUJOCO
from ksl.robot_files.mjcf_states import to_mujoco
from ksl.robot_files.mjcf_compiler import Refused, compiled
from ksl.robot_files.mjcf_frames import matrix

NO_CONSTRAINTS = 1 << 0
"""The bit of mjtDisableBit that turns contacts, limits, dry friction and equality constraints off."""
GRAVITY_DISABLED = 1 << 7
ACTUATION_DISABLED = 1 << 11
"""The bit that turns actuators off."""
OF_TENDONS = ("stiffness", "damping", "armature")


class RobotInMujoco(OtherRobot):
    library, version = "mujoco", mujoco.__version__

    def __init__(self, file: File) -> None:
        super().__init__(file)
        check_root(file)
        self.mj = self._loaded()
        self.data = mujoco.MjData(self.mj)
        self.mj.opt.disableflags |= NO_CONSTRAINTS
        self.nv, self.neutral = int(self.mj.nv), np.array(self.mj.qpos0)
        self.gravity = np.zeros(3) if self.mj.opt.disableflags & GRAVITY_DISABLED else np.array(self.mj.opt.gravity)
        self.body = {_named(self.mj.body, "body", i): i for i in range(self.mj.nbody)}

    def _loaded(self) -> Any:
        """The compiled model.  A URDF file without geometry, where its meshes aren't found: its tensors are in the file."""
        file = self.file
        if file.format == "sdf":
            raise NotLoaded("it reads URDF and MJCF, and no SDF")
        try:
            if file.format == "mjcf":
                return compiled(file.path, None, self.said.append)
            if not file.floating_base:
                return compiled(file.path, None, self.said.append)
        except Refused as e:
            if file.format == "mjcf":
                raise NotLoaded(f"its compiler refuses the file: {said_by(e)}") from None
            self.conventions.append(
                Note("geometry", f"it refuses the file ({said_by(e)[:200]}); read without shapes and meshes, which changes no number of links with <inertial>")
            )
        robot = without(file.contents, "link", "visual", "collision")
        try:
            return compiled(file.path, text(on_floating_joint(robot, file.model) if file.floating_base else robot), self.said.append)
        except Refused as e:
            raise NotLoaded(f"its compiler refuses the file: {said_by(e)}") from None

    def note(self) -> None:
        say, kinds = self.conventions.append, {self.model.joint(name).kind for name in self.model.joint_names}
        if kinds & {"floating", "spherical"}:
            say(Note("quaternion", "w x y z; KSL has x y z w"))
        if "floating" in kinds:
            say(Note("base", "linear velocity and force of a free body are in world axes, its angular ones in the body's; KSL has both in the body's"))
        say(
            Note(
                "frame", "mj_jacBody has translation and rotation apart, in world axes at the body's origin; KSL's jacobian is in the link's axes, linear first"
            )
        )
        gone = [link for link in self.model.link_names if link not in self.body] if self.file.format == "urdf" else []
        if gone:
            names = f"{', '.join(gone[:5])}{f' and {len(gone) - 5} more' if len(gone) > 5 else ''}"
            say(
                Note(
                    "lumped links",
                    f"in URDF, links welded to others are parts of these and have no frame (compiler, fusestatic), and the root is the world: {names}",
                )
            )
        say(Note("constraints", "limits, contacts, dry friction and equality constraints are switched off (mjDSBL_CONSTRAINT): they are soft forces there"))

    def place(self, joint: Joint) -> Place | None:
        if self.file.format == "mjcf":  # map() has them from KSL's own table
            return Place([], [], coordinates.same)
        i = mujoco.mj_name2id(self.mj, mujoco.mjtObj.mjOBJ_JOINT, joint.name)
        if i < 0:
            return None
        q, v = int(self.mj.jnt_qposadr[i]), int(self.mj.jnt_dofadr[i])
        kind = OF_MUJOCO[int(self.mj.jnt_type[i])].name
        if kind != joint.kind.replace("continuous", "revolute"):
            return None
        form = coordinates.free_linear_in_world(self.placement(joint)) if kind == "floating" else coordinates.same
        return Place(list(range(q, q + joint.nq)), list(range(v, v + joint.nv)), form)

    def map(self, q: Array, v: Array) -> Mapped:
        if self.file.format != "mjcf":
            return super().map(q, v)
        n, model = self.model.nv, self.model
        columns = [to_mujoco(model, q, np.broadcast_to(row, v.shape)).v for row in np.eye(n)]
        return Mapped(to_mujoco(model, q).q, np.stack([np.asarray(c) for c in columns], axis=-1), np.asarray(to_mujoco(model, q, v, np.zeros_like(v)).a))

    def links(self) -> list[str]:
        return [link for link in self.model.link_names if link in self.body]

    def bodies(self) -> dict[str, Array]:
        mj, data = self.mj, self.data
        found: dict[str, Array] = {}
        data.qpos[:] = self.neutral
        mujoco.mj_kinematics(mj, data)
        for i in range(1, mj.nbody):
            top = int(mj.body_weldid[i])
            if top:
                R = matrix(mj.body_iquat[i])
                X = np.linalg.solve(self._pose(top), self._pose(i))
                P = X @ pseudo_inertia(mj.body_mass[i], mj.body_ipos[i], (R * mj.body_inertia[i]) @ R.T) @ X.T
                name = _named(mj.body, "body", top)
                found[name] = found.get(name, np.zeros((4, 4))) + P
        return found

    def _pose(self, i: int) -> Array:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.data.xmat[i].reshape(3, 3), self.data.xpos[i]
        return T

    def effects(self) -> dict[str, str]:
        mj, found = self.mj, {}
        if mj.nu:
            found["actuators"] = f"{_names(_named(mj.actuator, 'actuator', i) for i in range(mj.nu))} exert forces at a control of zero, as servos do"
        if mj.body_gravcomp.any():
            found["gravcomp"] = f"gravity of {_names(_named(mj.body, 'body', int(i)) for i in np.flatnonzero(mj.body_gravcomp))} is compensated there"
        if mj.opt.density or mj.opt.viscosity:
            found["fluid"] = f"bodies move in a fluid there, of density {mj.opt.density:g} kg/m³ and viscosity {mj.opt.viscosity:g} Pa s"
        if any(values is not None and np.any(values) for values in (getattr(mj, f"tendon_{word}", None) for word in OF_TENDONS)):
            found["tendons"] = f"{_names(_named(mj.tendon, 'tendon', i) for i in range(mj.ntendon))} exert passive forces there"
        return found

    @contextmanager
    def without(self, topics: frozenset[str]) -> Iterator[None]:
        kept = self.mj, self.data
        mj = self.mj = copy.copy(self.mj)
        if "actuators" in topics:
            mj.opt.disableflags |= ACTUATION_DISABLED
        if "gravcomp" in topics:
            mj.body_gravcomp[:] = 0.0
        if "fluid" in topics:
            mj.opt.density = mj.opt.viscosity = 0.0
        for word in OF_TENDONS if "tendons" in topics else ():
            if hasattr(mj, f"tendon_{word}"):
                getattr(mj, f"tendon_{word}")[:] = 0.0
        self.data = mujoco.MjData(mj)
        try:
            yield
        finally:
            self.mj, self.data = kept

    def compute(self, q: Array, v: Array, a: Array, tau: Array, links: list[str]) -> OneState:
        mj, data = self.mj, self.data
        mujoco.mj_resetData(mj, data)
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, v, tau
        mujoco.mj_forward(mj, data)
        accelerations, M = data.qacc.copy(), np.zeros((self.nv, self.nv))
        _full_mass_matrix(mj, data, M)
        poses: dict[str, Array] = {}
        jacobians: dict[str, Array] = {}
        for link in links:
            i = self.body[link]
            poses[link] = self._pose(i)
            J = np.zeros((2, 3, self.nv))
            mujoco.mj_jacBody(mj, data, J[0], J[1], i)
            jacobians[link] = (poses[link][:3, :3].T @ J).reshape(6, self.nv)
        data.qacc[:] = a
        mujoco.mj_inverse(mj, data)
        return OneState(data.qfrc_inverse.copy(), accelerations, M, poses, jacobians)


def _named(of: Any, kind: str, i: int) -> str:
    """The name of one of MuJoCo's things, or what KSL calls a body without one."""
    return str(of(i).name) or f"{kind}{i}"


def _names(names: Iterable[str]) -> str:
    found = list(names)
    return f"{', '.join(found[:5])}{' …' if len(found) > 5 else ''}"


def _full_mass_matrix(mj: Any, data: Any, M: Array) -> None:
    try:
        mujoco.mj_fullM(mj, data, M)
    except TypeError:  # before MuJoCo 4
        mujoco.mj_fullM(mj, M, data.qM)
