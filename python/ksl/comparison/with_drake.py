"""The robot in Drake: URDF, SDF and MJCF as its parser reads them."""

from __future__ import annotations

import logging
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from pydrake.multibody.math import SpatialVelocity  # noqa: F401 - its types must be known before those of the plant are returned
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable, MultibodyForces

from ksl.comparison import coordinates
from ksl.comparison.bodies import of_moments, welded
from ksl.comparison.coordinates import Array, Form
from ksl.comparison.other_robot import said_by, File, NotLoaded, OneState, OtherRobot, Place, check_root
from ksl.comparison.results import Note
from ksl.comparison.urdf_text import of_one_model, text, without
from ksl.mechanism.mechanism import Joint

FORMS: dict[tuple[str, str], Form] = {
    ("revolute", "revolute"): coordinates.same,
    ("continuous", "revolute"): coordinates.same,
    ("prismatic", "prismatic"): coordinates.same,
    ("helical", "screw"): coordinates.same,
    ("planar", "planar"): coordinates.planar_in_parent,
}
"""Kinds of KSL and of Drake whose numbers can be converted.  Universal joints and balls have angles there, and other rates."""


class _Said(logging.Handler):
    """Collects what Drake says of a file, which would go to the terminal."""

    def __init__(self, lines: list[str]) -> None:
        super().__init__()
        self.lines = lines

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


class RobotInDrake(OtherRobot):
    library = "drake"

    def __init__(self, file: File) -> None:
        super().__init__(file)
        check_root(file)
        try:
            self.version = version("drake")
        except PackageNotFoundError:
            self.version = ""
        self.plant = MultibodyPlant(time_step=0.0)
        self._load()
        self.context = self.plant.CreateDefaultContext()
        self.nv, self.neutral = self.plant.num_velocities(), self.plant.GetPositions(self.context)
        self.gravity = np.array(self.plant.gravity_field().gravity_vector())
        self.body = {link: self.plant.GetBodyByName(link) for link in self.model.link_names if self.plant.HasBodyNamed(link)}

    def _load(self) -> None:
        log, handler = logging.getLogger("drake"), _Said(self.said)
        handlers, propagate = log.handlers[:], log.propagate
        log.handlers, log.propagate = [handler], False
        try:
            if self.file.format == "urdf" and b"<mimic" in self.file.contents:
                self.conventions.append(
                    Note("mimic", "joints that mimic others are constraints, which a plant in continuous time refuses; read without <mimic>")
                )
                Parser(self.plant).AddModelsFromString(text(without(self.file.contents, "joint", "mimic")), "urdf")
            elif self.file.chosen is not None:
                Parser(self.plant).AddModelsFromString(text(of_one_model(self.file.contents, self.file.chosen)), "sdf")
            else:
                Parser(self.plant).AddModels(self.file.path)
            root = self.plant.GetBodyByName(self.model.root) if self.plant.HasBodyNamed(self.model.root) else None
            if self.file.format == "urdf" and not self.file.floating_base and root is not None and self.model.root != "world":
                self.plant.WeldFrames(self.plant.world_frame(), root.body_frame())
                self.conventions.append(
                    Note("base", "the root floats unless a program welds it, which was done; KSL's stands unless floating_base asks for it")
                )
            self.plant.Finalize()
        except (ValueError, RuntimeError) as e:
            raise NotLoaded(f"it refuses the file: {said_by(e)}") from None
        finally:
            log.handlers, log.propagate = handlers, propagate

    def note(self) -> None:
        say, kinds = self.conventions.append, {self.model.joint(name).kind for name in self.model.joint_names}
        if "floating" in kinds:
            say(Note("quaternion", "w x y z, before the position; KSL has the position, then x y z w"))
            say(Note("base", "velocities are angular before linear, in world axes; KSL has linear first, in the body's axes"))
            say(Note("order", "the floating base comes first in q and v"))
        say(Note("frame", "Jacobians and wrenches are angular first; KSL has linear first unless order= says otherwise"))

    def place(self, joint: Joint) -> Place | None:
        name = joint.child if joint.kind == "floating" else joint.name  # Drake calls the joint of a free body as the body
        if not self.plant.HasJointNamed(name):
            return None
        found = self.plant.GetJointByName(name)
        floats = (joint.kind, found.type_name()) == ("floating", "quaternion_floating")
        form = coordinates.free_in_world(self.placement(joint)) if floats else FORMS.get((joint.kind, found.type_name()))
        q, v = found.position_start(), found.velocity_start()
        return None if form is None else Place(list(range(q, q + found.num_positions())), list(range(v, v + found.num_velocities())), form)

    def links(self) -> list[str]:
        return list(self.body)

    def bodies(self) -> dict[str, Array]:
        found = {}
        for name, links in welded(self.model).items():
            if name in self.body:
                I = self.plant.CalcSpatialInertia(self.context, self.body[name].body_frame(), [self.body[x].index() for x in links if x in self.body])
                about_origin = np.array(I.CalcRotationalInertia().CopyToFullMatrix3())
                found[name] = of_moments(I.get_mass(), I.get_mass() * np.array(I.get_com()), about_origin)
        return found

    def compute(self, q: Array, v: Array, a: Array, tau: Array, links: list[str]) -> OneState:
        plant, context = self.plant, self.context
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        efforts = plant.CalcInverseDynamics(context, a, forces)
        plant.get_applied_generalized_force_input_port().FixValue(context, tau)
        accelerations = np.array(plant.get_generalized_acceleration_output_port().Eval(context))
        poses, jacobians = {}, {}
        for link in links:
            body = self.body[link]
            poses[link] = np.array(plant.EvalBodyPoseInWorld(context, body).GetAsMatrix4())
            jacobians[link] = np.roll(self._jacobian(body), 3, axis=0)
        return OneState(np.array(efforts), accelerations, np.array(plant.CalcMassMatrix(context)), poses, jacobians)

    def _jacobian(self, body: Any) -> Array:
        frame = body.body_frame()
        J = self.plant.CalcJacobianSpatialVelocity(self.context, JacobianWrtVariable.kV, frame, np.zeros(3), self.plant.world_frame(), frame)
        return np.array(J)
