"""Small mechanisms with loops for the tests: a spatial one without redundant constraints, and a planar one."""

INERTIA = '<inertial><mass value="1"/><inertia ixx="0.011" iyy="0.012" izz="0.013" ixy="0" ixz="0" iyz="0"/></inertial>'
MOTOR = '<transmission name="t"><joint name="A"/><actuator name="m"/></transmission>'


def hinge(name: str, parent: str, child: str, xyz: str = "0 0 0", axis: str = "0 0 1", kind: str = "continuous") -> str:
    turns = "" if kind == "fixed" else f'<axis xyz="{axis}"/>'
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>{turns}</joint>'


def spatial(
    *more: str,
    ball: str = "0 0.3 0",
    crank: str = "0 0.1 0",
    rod: str = "0.1 0.2 0.4",
    cross: str = "continuous",
    motors: str = MOTOR,
    axes: tuple[str, str] = ("0 1 0", "1 0 0"),
) -> str:
    """Crank, rod and rocker: four hinges A, B, C and E, and a ball D, 7 freedoms, of which the loop takes 6.  It is closed at zero."""
    links = "".join(f'<link name="{name}">{INERTIA}</link>' for name in ("crank", "cross", "rod", "rocker"))
    hinges = (
        hinge("A", "ground", "crank")
        + hinge("B", "crank", "cross", crank, axes[0])
        + hinge("C", "cross", "rod", axis=axes[1], kind=cross)
        + hinge("E", "ground", "rocker", "0.1 0 0.4")
    )
    loop = (
        f'<constraint name="D" type="spherical"><parent link="rod"/><parent_origin xyz="{rod}"/><child link="rocker"/><child_origin xyz="{ball}"/></constraint>'
    )
    return f'<robot name="spatial"><link name="ground"/>{links}\n{hinges}\n{loop}\n{motors}{"".join(more)}</robot>'


def planar(rpy: str = "0 0 0", rod: str = "0.5 0 0", kind: str = "continuous") -> str:
    """A four-bar linkage with axes along z, a parallelogram with a crank of 0.2 m, upright at zero."""
    links = "".join(f'<link name="{name}">{INERTIA}</link>' for name in ("crank", "rod", "rocker"))
    hinges = hinge("A", "ground", "crank") + hinge("B", "crank", "rod", "0 0.2 0") + hinge("E", "ground", "rocker", "0.5 0 0")
    pin = f'<constraint name="D" type="{kind}"><parent link="rod"/><parent_origin xyz="{rod}"/><child link="rocker"/><child_origin xyz="0 0.2 0" rpy="{rpy}"/><parent_axis xyz="0 0 1"/></constraint>'
    return f'<robot name="planar"><link name="ground"/>{links}\n{hinges}\n{pin}\n{MOTOR}</robot>'


FLAT = {"crank": "0.2 0 0", "rod": "0.1 0 0.4", "ball": "0.2 0 0", "axes": ("0 0 1", "0 1 0")}
"""Crank and rocker of equal length in one plane with the rod, whose first hinge is parallel to theirs."""

IDLE = spatial(f'<link name="tip">{INERTIA}</link>', hinge("F", "rod", "tip")).replace(
    '<parent link="rod"/><parent_origin', '<parent link="tip"/><parent_origin'
)
"""With a hinge more before the ball, about which the tip turns by itself."""

WIDE = (
    spatial()
    .replace('"E" type="continuous"', '"E" type="revolute"')
    .replace('<origin xyz="0.1 0 0.4"/>', '<origin xyz="0.1 0 0.4"/><limit lower="-2" upper="0.05" effort="9" velocity="9"/>')
)
"""The rocker's limit is beyond where the crank moves it."""

CASES = {
    "loop-frames": (planar("0.1 0 0"), spatial()),
    "loop-open": (spatial(ball="0 3 0"), spatial(ball="0 0.3 0.0")),
    "loop-open-at-zero": (spatial(ball="0 0.31 0"), spatial()),
    "loop-singular": (spatial(**FLAT), spatial()),
    "loop-redundant": (planar(), spatial()),
    "loop-rigid": (spatial(cross="fixed", motors=""), spatial()),
    "loop-drives": (IDLE, spatial()),
    "loop-drives-unknown": (spatial(motors=""), spatial()),
    "loop-limits": (WIDE, WIDE.replace('lower="-2"', 'lower="-0.02"')),
}
"""{rule: (a file that it alone finds fault with, one beside it that is sound)}."""


def _bodies(ball: str, crank: str, rod: str, cross: str, axes: tuple[str, str], tip: bool, kind: str) -> tuple[list[tuple[str, str, str, str, str, str]], str]:
    """(joint, kind, parent, child, place, axis) of the tree of `spatial`, or of `planar`, and the link that the loop joint begins at."""
    bodies = [("A", "hinge", "ground", "crank", "0 0 0", "0 0 1")]
    if kind == "spatial":
        bodies += [
            ("B", "hinge", "crank", "cross", crank, axes[0]),
            ("C", cross, "cross", "rod", "0 0 0", axes[1]),
            ("E", "hinge", "ground", "rocker", "0.1 0 0.4", "0 0 1"),
        ]
    else:
        bodies += [("B", "hinge", "crank", "rod", crank, "0 0 1"), ("E", "hinge", "ground", "rocker", "0.5 0 0", "0 0 1")]
    return bodies + ([("F", "hinge", "rod", "tip", "0 0 0", "0 0 1")] if tip else []), "tip" if tip else "rod"


def in_sdf(
    ball: str = "0 0.3 0", crank: str = "0 0.1 0", cross: str = "hinge", axes: tuple[str, str] = ("0 1 0", "1 0 0"), tip: bool = False, kind: str = "spatial"
) -> str:
    """`spatial` or `planar` in SDF, where links have their places in the model, so that the loop is closed there."""
    bodies, begins = _bodies(ball, crank, "", cross, axes, tip, kind)
    at = {"ground": "0 0 0"}
    links = joints = ""
    for name, of, parent, child, place, axis in bodies:
        at[child] = " ".join(f"{float(a) + float(b):g}" for a, b in zip(at[parent].split(), place.split(), strict=True))
        links += f'<link name="{child}"><pose>{at[child]} 0 0 0</pose><inertial><mass>1</mass><inertia><ixx>0.011</ixx><iyy>0.012</iyy><izz>0.013</izz></inertia></inertial></link>'
        turns = "" if of == "fixed" else f"<axis><xyz>{axis}</xyz></axis>"
        joints += f'<joint name="{name}" type="{"fixed" if of == "fixed" else "continuous"}"><parent>{parent.replace("ground", "world")}</parent><child>{child}</child>{turns}</joint>\n'
    closing = "ball" if kind == "spatial" else "continuous"
    turns = "" if kind == "spatial" else "<axis><xyz>0 0 1</xyz></axis>"
    joints += f'<joint name="D" type="{closing}"><pose>{ball} 0 0 0</pose><parent>{begins}</parent><child>rocker</child>{turns}</joint>'
    return f'<sdf version="1.10"><model name="m">{links}\n{joints}</model></sdf>'


def in_mjcf(
    ball: str = "0 0.3 0", crank: str = "0 0.1 0", rod: str = "0.1 0.2 0.4", cross: str = "hinge", axes: tuple[str, str] = ("0 1 0", "1 0 0"),
    tip: bool = False, kind: str = "spatial", motors: str = '<motor joint="A"/>', tilted: str = "0 0 0.1",
) -> str:  # fmt: skip
    """The same in MJCF, with sites on both sides of the loop; two pairs of them for the hinge of `planar`, apart by 0.1 m along its axis, or as `tilted` on the rod."""
    bodies, begins = _bodies(ball, crank, rod, cross, axes, tip, kind)
    ends = {begins: ("p", rod, tilted), "rocker": ("s", ball, "0 0 0.1")}

    def body(link: str) -> str:
        inside = "".join(_body(name, of, child, place, axis) for name, of, parent, child, place, axis in bodies if parent == link)
        if link not in ends:
            return inside
        side, place, along = ends[link]
        second = " ".join(f"{float(a) + float(b):g}" for a, b in zip(place.split(), along.split(), strict=True))
        return inside + f'<site name="{side}0" pos="{place}"/><site name="{side}1" pos="{second}"/>'

    def _body(name: str, of: str, child: str, place: str, axis: str) -> str:
        joint = "" if of == "fixed" else f'<joint name="{name}" type="hinge" axis="{axis}"/>'
        return f'<body name="{child}" pos="{place}">{joint}<inertial pos="0 0 0" mass="1" diaginertia="0.011 0.012 0.013"/>{body(child)}</body>'

    pairs = "".join(f'<connect name="D_{i}" site1="p{i}" site2="s{i}"/>' for i in ([0] if kind == "spatial" else [0, 1]))
    return f'<mujoco model="m"><compiler angle="radian"/><worldbody>{body("ground")}</worldbody>\n<equality>{pairs}</equality><actuator>{motors}</actuator></mujoco>'


PLANAR = {"kind": "planar", "ball": "0 0.2 0", "crank": "0 0.2 0"}
IN_SDF = {
    "loop-redundant": (in_sdf(**PLANAR), ["A"]),
    "loop-singular": (in_sdf(**{k: v for k, v in FLAT.items() if k != "rod"}), ["A"]),
    "loop-rigid": (in_sdf(cross="fixed"), None),
    "loop-drives": (in_sdf(tip=True), ["A"]),
    "loop-drives-unknown": (in_sdf(), None),
    "loop-limits": (
        in_sdf()
        .replace('"E" type="continuous"', '"E" type="revolute"')
        .replace(
            '</child><axis><xyz>0 0 1</xyz></axis></joint>\n<joint name="D"',
            '</child><axis><xyz>0 0 1</xyz><limit><lower>-2</lower><upper>0.05</upper></limit></axis></joint>\n<joint name="D"',
        ),
        ["A"],
    ),
}
"""{rule: (a file that it alone finds fault with, drives)}.  In SDF, loops are closed where the links are placed, with axes that agree."""
IN_MJCF = {
    "loop-frames": in_mjcf(**PLANAR, rod="0.5 0 0", tilted="0 0.06 0.08"),
    "loop-open": in_mjcf(ball="0 3 0"),
    "loop-open-at-zero": in_mjcf(ball="0 0.31 0"),
    "loop-redundant": in_mjcf(**PLANAR, rod="0.5 0 0"),
    "loop-singular": in_mjcf(**FLAT),
    "loop-rigid": in_mjcf(cross="fixed", motors=""),
    "loop-drives": in_mjcf(tip=True),
    "loop-drives-unknown": in_mjcf(motors=""),
    "loop-limits": in_mjcf().replace('name="E" type="hinge"', 'name="E" type="hinge" range="-2 0.05"'),
}
