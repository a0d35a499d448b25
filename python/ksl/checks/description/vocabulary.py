"""Elements and attributes of URDF: those of the format, and extensions that a known program reads.

Sources: https://wiki.ros.org/urdf/XML; urdfdom's schema; for the extensions, the documentation of Gazebo, Bullet,
Drake, MoveIt and PAL's
robots; for loops, the proposal for urdfdom, Isaac Sim's and URDF+'s.
"""

from __future__ import annotations

ELEMENTS: dict[str, tuple[str, ...]] = {
    "robot": (
        "link",
        "joint",
        "material",
        "transmission",
        "gazebo",
        "ros2_control",
        "sensor",
        "group",
        "mujoco",
        "loop_constraint",
        "constraint",
        "loop_joint",
        "loop",
        "coupling",
        "force_element",
    ),
    "force_element": ("link1", "link2"),
    "constraint": (
        "parent",
        "parent_origin",
        "parent_axis",
        "parent_axis2",
        "child",
        "child_origin",
        "child_axis",
        "child_axis2",
        "screw_thread_pitch",
        "limit",
        "dynamics",
        "mimic",
    ),
    "link": ("inertial", "visual", "collision", "contact", "self_collision_checking", "collision_checking"),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry", "verbose"),
    "geometry": ("box", "cylinder", "sphere", "mesh", "capsule"),
    "joint": (
        "origin",
        "parent",
        "child",
        "axis",
        "axis2",
        "limit",
        "limit1",
        "limit2",
        "limit3",
        "dynamics",
        "mimic",
        "safety_controller",
        "calibration",
        "screw_thread_pitch",
    ),
    "origin": (),
    "mass": (),
    "inertia": (),
    "parent": (),
    "child": (),
    "axis": (),
    "axis2": (),
    "limit": (),
    "limit1": (),
    "limit2": (),
    "limit3": (),
    "dynamics": (),
    "mimic": (),
    "safety_controller": (),
    "calibration": (),
    "box": (),
    "cylinder": (),
    "sphere": (),
    "mesh": (),
    "capsule": (),
}
"""{element: what may stand in it}.  Elements that are no keys, and what is in them, are not looked at."""

OPAQUE: dict[str, tuple[str, ...]] = {"collision": ("material", "contact_coefficients"), "joint": ("limb",)}
"""Elements that stand in many files where no reader asks for them, and that do no harm."""

MANY = (
    "link",
    "joint",
    "constraint",
    "loop_joint",
    "loop",
    "coupling",
    "force_element",
    "material",
    "transmission",
    "gazebo",
    "ros2_control",
    "sensor",
    "visual",
    "collision",
)
"""Elements of which several may stand beside each other; of others a second one is no spelling mistake."""

SHARED = ("plugin", "frame")

POSE = ("xyz", "rpy", "quat_xyzw")

ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "link": ("name", "type"),
    "inertial": (),
    "origin": POSE,
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "visual": ("name",),
    "collision": ("name", "group"),
    "geometry": (),
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "capsule": ("radius", "length"),
    "mesh": ("filename", "scale"),
    "joint": ("name", "type", "dont_collapse"),
    "parent": ("link",),
    "child": ("link",),
    "axis": ("xyz",),
    "axis2": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"),
    "dynamics": (
        "damping",
        "friction",
        "armature",
        "rotor_inertia",
        "gear_ratio",
        "spring_stiffness",
        "spring_reference",
        "spring_rest",
        "stiffness",
        "friction_width",
    ),
    "mimic": ("joint", "multiplier", "offset"),
    "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
    "calibration": ("rising", "falling", "reference_position"),
}
