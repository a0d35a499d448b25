"""An example for each algorithm that is called most, for the docstrings of Python; test/contract/call_examples_test.py runs them.

There m is a UR5, q, v, a and tau are numbers of its six joints.
"""

EXAMPLES: dict[str, str] = {
    "inverse_dynamics": """
tau = m.inverse_dynamics(q, v, a)                                   # (6,), N m
pushed = m.inverse_dynamics(q, v, a, external={"tool0": [0, 0, -20, 0, 0, 0]})
""",
    "reactions": """
f = m.reactions(q, v, a)                                            # (6, 6): on the children of the moving joints
moved = m.reactions(q, v, a, at=(0, 0, 0.05), axes="world", joints=["wrist_3"])
""",
    "effort_parts": """
parts = m.with_physics("all").effort_parts(q, v, a)                 # (5, 6): transmitted, damping, friction, rotor, spring
""",
    "bias": """
b = m.bias(q, v)                                                    # (6,): M(q) a + b = tau
""",
    "gravity_torque": """
g = m.gravity_torque(q)                                             # (6,): what holds the robot still
""",
    "forward_dynamics": """
a = m.forward_dynamics(q, v, tau)                                   # (6,), rad/s²
""",
    "hybrid_dynamics": """
a, tau = m.hybrid_dynamics(q, v, a, tau, names=["elbow"])           # the acceleration of elbow is given, the efforts of the others
""",
    "mass_matrix": """
M = m.mass_matrix(q)                                                # (6, 6), kg m²
""",
    "coriolis_matrix": """
C = m.coriolis_matrix(q, v)                                         # (6, 6): C v + gravity_torque(q) = bias(q, v)
""",
    "frame_pose": """
T = m.frame_pose(q, "tool0")                                        # (4, 4): in the world
tool = ksl.Pose(T, to="world", of="tool0")
""",
    "frame_poses": """
T = m.frame_poses(q, ["wrist_3_link", "tool0"])                     # (2, 4, 4)
""",
    "frame_velocity": """
s = m.frame_velocity(q, v, "tool0", axes="world")                   # (6,): m/s of its origin, rad/s
""",
    "frame_acceleration": """
s = m.frame_acceleration(q, v, a, "tool0", kind="classical", axes="world")
""",
    "jacobian": """
J = m.jacobian(q, "tool0", axes="world")                            # (6, 6): frame_velocity is J v
""",
    "energy": """
kinetic, potential = m.energy(q, v)                                 # J
""",
    "center_of_mass": """
c = m.center_of_mass(q)                                             # (3,), m, in the world
""",
    "inverse_dynamics_derivatives": """
by_q, by_v, by_a = m.inverse_dynamics_derivatives(q, v, a)          # (6, 6) each
""",
    "inverse_dynamics_regressor": """
Y = m.inverse_dynamics_regressor(q, v, a)
tau = np.einsum("vlp,lp->v", Y, m.parameters)                       # (6,): that of inverse_dynamics
""",
    "integrate": """
q1 = m.integrate(q, 0.001 * v)                                      # a step of 1 ms, also for quaternions
""",
    "difference": """
dv = m.difference(q, m.integrate(q, 0.001 * v))                     # 0.001 v
""",
}
"""{algorithm: Python}."""
