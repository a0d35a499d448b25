"""Whose rule of reading a file a difference comes from: what the documents of the libraries say."""

from __future__ import annotations

RULES = {
    ("mujoco", "armature"): "in MJCF armature adds to the diagonal of the mass matrix, and nothing turns that off (XML reference, joint/armature)",
    ("mujoco", "damping"): "damping is a passive force, which mj_forward and mj_inverse include; MuJoCo reads <dynamics damping> of URDF, too",
    ("mujoco", "spring"): "stiffness and springref are passive forces, which mj_forward and mj_inverse include",
    ("mujoco", "force elements"): "springs and dampers of tendons are passive forces, which mj_forward and mj_inverse include",
    ("mujoco", "actuators"): "with controls of zero, mj_forward adds what actuators exert; KSL's efforts are all that drives exert",
    ("mujoco", "gravcomp"): "in MJCF gravcomp lifts bodies by a force at their centre of mass; in KSL gravity acts on them in full",
    ("mujoco", "fluid"): "density and viscosity of <option> are forces on moving bodies; KSL has none",
    ("mujoco", "tendons"): "springs, dampers and armature of tendons that KSL doesn't read act there",
    ("mujoco", "masses"): "MuJoCo gives links without <inertial> the mass of their geometry, and welds the root of a URDF file to the world",
    ("mujoco", "gravity"): "<option gravity>, (0, 0, -9.81) by default",
    ("pinocchio", "armature"): "its reader of MJCF fills model.armature, which rnea, aba and crba add; a URDF file gives it none",
    ("pinocchio", "rotor"): "model.rotorInertia and model.rotorGearRatio are filled, and applied where armature is set from them",
    ("pinocchio", "damping"): "it keeps model.damping, and applies it nowhere",
    ("pinocchio", "friction"): "it keeps model.friction, and applies it nowhere",
    ("pinocchio", "gravity"): "model.gravity is (0, 0, -9.81) whatever the file says",
    ("pinocchio", "masses"): "a link without <inertial> has no mass there, either",
    (
        "drake",
        "damping",
    ): "damping of a joint (<dynamics damping> in URDF) is a force element, which CalcForceElementsContribution and forward dynamics include",
    ("drake", "rotor"): "drake:rotor_inertia and drake:gear_ratio of a transmission's actuator add to the diagonal of the mass matrix",
    ("drake", "masses"): "Drake's parser replaces tensors that no body can have, and says so; KSL warns and keeps them, `ksl check` shows them",
    ("drake", "gravity"): "9.81 m/s² down z, whatever the file says",
}
GENERAL = {"masses": "masses, centroids or tensors of bodies are others there", "gravity": "programs choose it, and files of some formats"}
"""What is said of libraries for which there is no sentence of its own."""


def rule(library: str, topic: str) -> str:
    """A sentence for a topic: damping, friction, armature, rotor, spring, force elements, masses or gravity."""
    return RULES.get((library, topic)) or GENERAL.get(topic, "physics of joints are off in KSL unless physics= names them")
