"""Names that other libraries have for calls of a model: what is said of one that there isn't."""

from __future__ import annotations

from collections.abc import Collection

OF_MODEL = {
    "add_payload": "with_payload(link, mass, center_of_mass)",
    "body_jacobian": "jacobian(q, name)",
    "centroidal_map": "centroidal_momentum_matrix(q)",
    "check": "ksl.check(path)",
    "com": "center_of_mass(q)",
    "compare": "ksl.compare(robot)",
    "compute_jacobian": "jacobian(q, name)",
    "compute_loads": "wrench_table(time, q, v, a), or ksl.compute_loads(m, motion)",
    "coriolis": "coriolis_matrix(q, v), or bias(q, v)",
    "display": "show(q)",
    "constraints": "loops, the joints that close loops",
    "dof": "nv",
    "dofs": "nv",
    "export": "to_urdf(path)",
    "fd": "forward_dynamics(q, v, tau)",
    "fk": "frame_poses(q, names), or frame_pose(q, name)",
    "fkine": "frame_poses(q, names), or frame_pose(q, name)",
    "forward_kinematics": "frame_poses(q, names), or frame_pose(q, name)",
    "frame_jacobian": "jacobian(q, name)",
    "frame_placement": "frame_pose(q, name)",
    "gravity_compensation": "gravity_torque(q)",
    "gravity_vector": "gravity_torque(q)",
    "id": "inverse_dynamics(q, v, a)",
    "ik": "inverse_kinematics(names, target)",
    "ikine": "inverse_kinematics(names, target)",
    "inertia_matrix": "mass_matrix(q)",
    "joint_limits": "lower, upper, velocity_limit and effort_limit",
    "joint_reactions": "reactions(q, v, a)",
    "joint_wrenches": "reactions(q, v, a)",
    "kinetic_energy": "energy(q, v)[0]",
    "link_pose": "frame_pose(q, name)",
    "link_poses": "frame_poses(q, names)",
    "loads": "wrench_table(time, q, v, a), or ksl.compute_loads(m, motion)",
    "lower_limit": "lower",
    "lower_limits": "lower",
    "n_dof": "nv",
    "n_joints": "nv, how many numbers v has, or len(joint_names)",
    "ndof": "nv",
    "neutral_configuration": "neutral()",
    "nle": "bias(q, v)",
    "nonlinear_effects": "bias(q, v)",
    "num_dofs": "nv",
    "plot": "show(q)",
    "position_limits": "lower and upper",
    "potential_energy": "energy(q, v)[1]",
    "random_configuration": "random()",
    "reaction_forces": "reactions(q, v, a)",
    "save": "to_urdf(path)",
    "set_gravity": "with_gravity(gravity): models are immutable",
    "set_payload": "with_payload(link, mass, center_of_mass)",
    "rollout": "simulate(q, v, times)",
    "step": "simulate(q, v, times), or forward_dynamics(q, v, tau) and integrate(q, v * dt)",
    "upper_limit": "upper",
    "upper_limits": "upper",
    "view": "show(q)",
    "visualize": "show(q)",
    "write_urdf": "to_urdf(path)",
    "wrenches": "reactions(q, v, a), or wrench_table(time, q, v, a)",
}
"""{name: the call of a model that does it, or the attribute that has it}."""

OF_PACKAGE = {
    "Robot": "ksl.load(path) returns a ksl.Model",
    "analyze": "ksl.compute_loads(robot, motion) computes every wrench along a motion",
    "build_model": "ksl.load(path) reads a file, ksl.load_string(text) its contents",
    "from_file": "ksl.load(path) reads a file",
    "from_string": "ksl.load_string(text) reads the contents of a robot file",
    "from_urdf": "ksl.load(path) reads a file, ksl.load_string(text) its contents",
    "load_mjcf": "ksl.load(path) reads URDF, SDF and MJCF",
    "load_motion": "ksl.read_motion(model, path) reads a motion",
    "load_sdf": "ksl.load(path) reads URDF, SDF and MJCF",
    "load_urdf": "ksl.load(path) reads URDF, SDF and MJCF",
    "loads": "ksl.load_string(text) reads a robot from text; ksl.compute_loads(robot, motion) computes every wrench along a motion",
    "open": "ksl.load(path) reads a file",
    "read": "ksl.load(path) reads a robot, ksl.read_motion(model, path) a motion",
    "reactions": "ksl.load(path).reactions(q, v, a): algorithms are methods of a model",
    "inverse_dynamics": "ksl.load(path).inverse_dynamics(q, v, a): algorithms are methods of a model",
    "run": "ksl.compute_loads(robot, motion) computes every wrench along a motion",
    "Simulation": "ksl.load(path).simulate(q, v, times): algorithms are methods of a model",
    "differentiable": "ksl.torch.differentiable(model), or ksl.jax.differentiable(model)",
    "integrate": "ksl.load(path).integrate(q, dv), or simulate(q, v, times): algorithms are methods of a model",
    "load_usd": "ksl.load(path) reads USD, URDF, SDF and MJCF",
    "load_xacro": "ksl.load(path) reads a xacro file with xacro=",
    "show": "ksl.load(path).show(q)",
    "simulate": "ksl.load(path).simulate(q, v, times): algorithms are methods of a model",
    "to_urdf": "ksl.load(path).to_urdf(path)",
    "view": "ksl.load(path).show(q)",
}
"""{name: what to call in its place}."""


def unknown_call(owner: str, called: str, name: str, known: Collection[str], of_model: Collection[str] = ()) -> str:
    """Says that an object has no attribute of this name, and which one is meant.

    owner: what it is; called: its name in examples; known: the attributes that it has; of_model: those of the model that it was made from.
    """
    from ksl.base.errors import near_names

    mend = OF_MODEL.get(name, "")
    if mend and (not of_model or _head(mend) in known):
        said = f"that is {called}.{mend}"
    elif name in of_model or _head(mend) in of_model:
        said = f"{near_names(name, known)}the model has it, without derivatives: m.{mend or name}"
    else:
        said = f"{near_names(name, known)}dir({called}) lists all"
    return f"{owner} has no {name!r}; {said}"


def _head(call: str) -> str:
    return call.partition("(")[0]
