"""Words of XML formats that fuzzing puts into texts, as a dictionary of libFuzzer."""

URDF_TAGS = (
    "robot link joint inertial origin mass inertia visual collision parent child axis axis2 limit limit1 limit2 limit3 dynamics mimic safety_controller "
    "calibration screw_thread_pitch drake:joint drake:screw_thread_pitch drake:rotor_inertia drake:gear_ratio transmission actuator gazebo material "
    "geometry mesh xacro:macro"
).split()
URDF_ATTRIBUTES = (
    "name version type xyz rpy quat_xyzw value ixx ixy ixz iyy iyz izz link lower upper effort velocity acceleration damping friction friction_width "
    "armature rotor_inertia gear_ratio spring_stiffness spring_reference joint multiplier offset filename scale xmlns:xacro"
).split()
URDF_VALUES = [
    "1.0", "1.1", "1.2", "fixed", "revolute", "continuous", "prismatic", "floating", "planar", "spherical", "universal", "helical", "cylindrical",
    "translation", "ball", "screw", "0 0 1", "0 0 0 1", "base", "world", "ground", "floating_base", "floating_root",
]  # fmt: skip
SDF_TAGS = (
    "sdf world model link joint drake:joint frame pose inertial mass inertia ixx ixy ixz iyy iyz izz parent child drake:parent drake:child axis axis2 "
    "xyz limit lower upper effort velocity dynamics damping friction spring_reference spring_stiffness mimic multiplier offset reference "
    "screw_thread_pitch thread_pitch static include gravity visual collision plugin use_parent_model_frame fluid_added_mass auto_inertia_params density"
).split()
SDF_ATTRIBUTES = "name version type relative_to attached_to expressed_in placement_frame canonical_link degrees rotation_format auto joint axis frame".split()
SDF_VALUES = [
    "1.7", "1.10", "1.11", "revolute", "revolute2", "continuous", "prismatic", "fixed", "ball", "universal", "screw", "gearbox", "planar", "world",
    "__model__", "euler_rpy", "quat_xyzw", "true", "false", "0 0 0 0 0 0", "::", "floating_base",
]  # fmt: skip
OF_ALL = [
    "&lt;", "&amp;", "&quot;", "&#0;", "&#27;", "&#x202e;", "&#", "&", "<!--", "-->", "<![CDATA[", "]]>", "<?", "?>", "<!DOCTYPE ", "<!ENTITY ", "1e-400",
    "1e400", "1e308", "-1e308", "4.9e-324", "nan", "inf", "-0", "0x1p3", " ", "/>", "></", "\\xff\\xfe", "\\xfe\\xff", "\\xef\\xbb\\xbf", "\\xc2\\x9b",
    "\\xe2\\x80\\xae", "\\x1b[", "\\x00",
]  # fmt: skip
"""Escapes, beginnings and ends of XML, numbers at the ends of their range, marks of encodings and controls, as libFuzzer writes them."""
WORDS = {"urdf": (URDF_TAGS, URDF_ATTRIBUTES, URDF_VALUES), "sdf": (SDF_TAGS, SDF_ATTRIBUTES, SDF_VALUES)}


def dictionary(format: str) -> str:
    """A word a line."""
    tags, attributes, values = WORDS[format]
    words = [*(form.format(tag) for tag in tags for form in ("<{}>", "</{}>", "<{} ")), *(f' {name}=\\"' for name in attributes), *values, *OF_ALL]
    return "".join(f'"{word}"\n' for word in words)
