"""The mechanism without its rods and cranks, and these alone: bodies that carry none of the named joints."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ksl.base.words import listed
from ksl.drivetrain.parts import Part
from ksl.mechanism.states import Array

if TYPE_CHECKING:
    from ksl.model.model import Model


class RodsCut:
    """Trees with the coordinates of the mechanism, textbook physics, in which some links have no mass."""

    def __init__(self, m: Model, part: Part) -> None:
        self.model = m
        self.tree = m.with_physics(None).without_loops()
        carrying = {name for joint in part.joints for name in m.support(m.joint(joint).child)}
        moving = [joint.name for joint in m.joints if joint.name in (*part.motors, *part.followers) or joint.leader in (*part.motors, *part.followers)]
        inner = [name for name in moving if name in carrying and name not in part.joints]
        self.joints = [name for name in moving if name not in carrying]
        """The joints by which rods and cranks begin, and those further out."""
        self.links = [link.name for link in m.links if link.name in {name for joint in self.joints for name in m.subtree_links(f"joint:{joint}")}]
        self.carried_by = listed(inner)
        """Joints of the mechanism that carry named ones, and can't be cut."""

    @cached_property
    def without_rods(self) -> Model:
        if self.carried_by:
            raise ValueError(
                f"joints: {self.carried_by} carry them, so that no tree of these joints alone is left when the mechanism is cut; name joints that hang on no crank or rod"
            )
        return self.tree.with_parameters({link: np.zeros(10) for link in self.links})

    @cached_property
    def rods_alone(self) -> Model:
        return self.tree.with_parameters({link.name: np.zeros(10) for link in self.model.links if link.name not in self.links})

    @cached_property
    def rotors(self) -> Array:
        """Inertia (nv) of rotors, at their joints, kg m²: I N², and armatures."""
        found = np.zeros(self.model.nv)
        for joint in self.model.joints:
            if joint.nv:
                found[joint.v_index : joint.v_index + joint.nv] = joint.armature + (joint.rotor_inertia * joint.gear_ratio**2 if joint.one_coordinate else 0.0)
        return found
