"""The robot in Pinocchio: URDF, and MJCF as its own reader has it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ksl.comparison import coordinates
from ksl.comparison.bodies import pseudo_inertia, welded
from ksl.comparison.coordinates import Array, Form
from ksl.comparison.other_robot import said_by, File, NotLoaded, OneState, OtherRobot, Place
from ksl.comparison.results import Note
from ksl.mechanism.mechanism import Joint

ROOT_JOINT = "root_joint"


class RobotInPinocchio(OtherRobot):
    library, version = "pinocchio", pin.__version__

    def __init__(self, file: File) -> None:
        super().__init__(file)
        self.p = self._loaded()
        self.data = self.p.createData()
        self.nv, self.neutral, self.gravity = self.p.nv, pin.neutral(self.p), np.array(self.p.gravity.linear)
        self.frame = {link: self.p.getFrameId(link, pin.FrameType.BODY) for link in self.model.link_names if self.p.existFrame(link, pin.FrameType.BODY)}

    def _loaded(self) -> pin.Model:
        file = self.file
        if file.format == "sdf":
            raise NotLoaded("its package for Python is built without SDF")
        try:
            if file.format == "mjcf":
                return pin.buildModelFromMJCF(file.path)
            return pin.buildModelFromUrdf(file.path, pin.JointModelFreeFlyer()) if file.floating_base else pin.buildModelFromUrdf(file.path)
        except (ValueError, RuntimeError) as e:
            raise NotLoaded(f"it refuses the file: {said_by(e)}") from None

    def note(self) -> None:
        say, names = self.conventions.append, self.model.joint_names
        order = sorted(range(len(names)), key=lambda i: int(self.p.joints[self._id(self.model.joint(names[i]))].idx_v))
        if order != sorted(order):
            say(
                Note(
                    "order", f"joints are depth first with children sorted by name ({', '.join(names[i] for i in order[:4])} …); KSL has the order of the file"
                )
            )
        turning = [name for name in names if self.model.joint(name).kind == "continuous"]
        if turning:
            say(Note("quaternion", f"a continuous joint has cosine and sine in q, KSL its angle ({len(turning)} joints)"))
        if any(self.model.joint(name).kind == "floating" for name in names):
            say(Note("base", "as KSL: position, then x y z w; velocity linear first, both parts in the body's axes"))
        if any(len(links) > 1 for links in welded(self.model).values()):
            say(Note("lumped links", "links that are welded to others are parts of these; they have frames, as in KSL"))

    def _id(self, joint: Joint) -> int:
        if joint.name in self.model.joint_names[:1] and joint.kind == "floating" and self.file.floating_base:
            return int(self.p.getJointId(ROOT_JOINT))
        return int(self.p.getJointId(joint.name))

    def place(self, joint: Joint) -> Place | None:
        i = self._id(joint)
        if i >= self.p.njoints or self.p.joints[i].nv != joint.nv:
            return None
        there = self.p.joints[i]
        form = self._form(joint, there.nq)
        return None if form is None else Place(list(range(there.idx_q, there.idx_q + there.nq)), list(range(there.idx_v, there.idx_v + there.nv)), form)

    def _form(self, joint: Joint, nq: int) -> Form | None:
        """How its nq numbers of a joint differ from KSL's."""
        if joint.kind == "floating":
            return coordinates.free(self.placement(joint))
        if joint.kind in ("continuous", "planar"):  # with cosine and sine; of planes that lie otherwise x and y are others
            return coordinates.cosine_and_sine if joint.kind == "continuous" or joint.axis == (0.0, 0.0, 1.0) else None
        return coordinates.same if nq == joint.nq else None

    def links(self) -> list[str]:
        return list(self.frame)

    def bodies(self) -> dict[str, Array]:
        found = {}
        for name in self.model.joint_names:
            i, link = self._id(self.model.joint(name)), self.model.joint(name).child
            if i < self.p.njoints and link in self.frame:
                I = self.p.inertias[i]
                X = np.linalg.inv(self.p.frames[self.frame[link]].placement.homogeneous)  # MJCF: a joint's frame is not that of its body
                found[link] = X @ pseudo_inertia(I.mass, np.array(I.lever), np.array(I.inertia)) @ X.T
        return found

    def compute(self, q: Array, v: Array, a: Array, tau: Array, links: list[str]) -> OneState:
        p, d = self.p, self.data
        accelerations = pin.aba(p, d, q, v, tau).copy()
        upper = np.triu(pin.crba(p, d, q).reshape(p.nv, p.nv))
        efforts = pin.rnea(p, d, q, v, a).copy()
        pin.computeJointJacobians(p, d, q)
        pin.updateFramePlacements(p, d)
        poses = {link: np.array(d.oMf[i].homogeneous) for link, i in self.frame.items()}
        jacobians = {link: np.array(pin.getFrameJacobian(p, d, i, pin.ReferenceFrame.LOCAL)).reshape(6, p.nv) for link, i in self.frame.items()}
        return OneState(efforts, accelerations, upper + np.triu(upper, 1).T, poses, jacobians)
