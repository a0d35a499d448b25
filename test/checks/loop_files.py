"""Small mechanisms with loops for the tests: a spatial one without redundant constraints, and a planar one."""

INERTIA = '<inertial><mass value="1"/><inertia ixx="0.011" iyy="0.012" izz="0.013" ixy="0" ixz="0" iyz="0"/></inertial>'
MOTOR = '<transmission name="t"><joint name="A"/><actuator name="m"/></transmission>'


def hinge(name: str, parent: str, child: str, xyz: str = "0 0 0", axis: str = "0 0 1", kind: str = "continuous") -> str:
    turns = "" if kind == "fixed" else f'<axis xyz="{axis}"/>'
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>{turns}</joint>'


def spatial(*more: str, ball: str = "0 0.3 0", crank: str = "0 0.1 0", rod: str = "0.1 0.2 0.4", cross: str = "continuous", motors: str = MOTOR, axes: tuple[str, str] = ("0 1 0", "1 0 0")) -> str:
    """Crank, rod and rocker: four hinges A, B, C and E, and a ball D, 7 freedoms, of which the loop takes 6.  It is closed at zero."""
    links = "".join(f'<link name="{name}">{INERTIA}</link>' for name in ("crank", "cross", "rod", "rocker"))
    hinges = hinge("A", "ground", "crank") + hinge("B", "crank", "cross", crank, axes[0]) + hinge("C", "cross", "rod", axis=axes[1], kind=cross) + hinge("E", "ground", "rocker", "0.1 0 0.4")
    loop = f'<constraint name="D" type="spherical"><parent link="rod"/><parent_origin xyz="{rod}"/><child link="rocker"/><child_origin xyz="{ball}"/></constraint>'
    return f'<robot name="spatial"><link name="ground"/>{links}\n{hinges}\n{loop}\n{motors}{"".join(more)}</robot>'


def planar(rpy: str = "0 0 0", rod: str = "0.5 0 0", kind: str = "continuous") -> str:
    """A four-bar linkage with axes along z, a parallelogram with a crank of 0.2 m, upright at zero."""
    links = "".join(f'<link name="{name}">{INERTIA}</link>' for name in ("crank", "rod", "rocker"))
    hinges = hinge("A", "ground", "crank") + hinge("B", "crank", "rod", "0 0.2 0") + hinge("E", "ground", "rocker", "0.5 0 0")
    pin = f'<constraint name="D" type="{kind}"><parent link="rod"/><parent_origin xyz="{rod}"/><child link="rocker"/><child_origin xyz="0 0.2 0" rpy="{rpy}"/><parent_axis xyz="0 0 1"/></constraint>'
    return f'<robot name="planar"><link name="ground"/>{links}\n{hinges}\n{pin}\n{MOTOR}</robot>'


FLAT = {"crank": "0.2 0 0", "rod": "0.1 0 0.4", "ball": "0.2 0 0", "axes": ("0 0 1", "0 1 0")}
"""Crank and rocker of equal length in one plane with the rod, whose first hinge is parallel to theirs."""

IDLE = spatial(f'<link name="tip">{INERTIA}</link>', hinge("F", "rod", "tip")).replace('<parent link="rod"/><parent_origin', '<parent link="tip"/><parent_origin')
"""With a hinge more before the ball, about which the tip turns by itself."""

CASES = {
    "loop-frames": (planar("0.1 0 0"), spatial()),
    "loop-open": (spatial(ball="0 3 0"), spatial(ball="0 0.3 0.0")),
    "loop-open-at-zero": (spatial(ball="0 0.31 0"), spatial()),
    "loop-singular": (spatial(**FLAT), spatial()),
    "loop-redundant": (planar(), spatial()),
    "loop-rigid": (spatial(cross="fixed", motors=""), spatial()),
    "loop-drives": (IDLE, spatial()),
    "loop-drives-unknown": (spatial(motors=""), spatial()),
}
"""{rule: (a file that it alone finds fault with, one beside it that is sound)}."""
