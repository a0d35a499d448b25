"""Robot files for the benchmarks: those of the package example-robot-data, and chains and trees made here.

robots.py OUTPUT_DIR writes URDF files and robots.txt: a line `name fixed|floating path` for each.  Run it with the Python
that has example-robot-data.
"""

import random
import sys
import sysconfig
from pathlib import Path

EXAMPLES = {
    "ur5": ("fixed", "ur_description/urdf/ur5_robot.urdf"),
    "panda": ("fixed", "panda_description/urdf/panda.urdf"),
    "solo12": ("floating", "solo_description/robots/solo12.urdf"),
    "talos": ("floating", "talos_data/robots/talos_reduced.urdf"),
}
SIZES = (4, 8, 16, 32, 64, 128)
LINEARITY = (250, 500, 1000)
KINDS = {  # joints of several axes, and the same freedoms as chains of one-axis joints
    "spherical": (("revolute", "1 0 0"), ("revolute", "0 1 0"), ("revolute", "0 0 1")),
    "universal": (("revolute", "1 0 0"), ("revolute", "0 1 0")),
    "cylindrical": (("revolute", "0 0 1"), ("prismatic", "0 0 1")),
}
KINDS_BODIES = 15


def link(name: str, rng: random.Random) -> str:
    mass = rng.uniform(0.5, 2)
    x, y, z = (rng.uniform(-0.1, 0.1) for _ in range(3))
    a, b, c = (mass * rng.uniform(0.008, 0.012) for _ in range(3))  # near enough to each other for a real body
    return (
        f'<link name="{name}"><inertial><origin xyz="{x:.6f} {y:.6f} {z:.6f}"/><mass value="{mass:.6f}"/>'
        f'<inertia ixx="{a:.6f}" iyy="{b:.6f}" izz="{c:.6f}" ixy="0.0005" ixz="-0.0004" iyz="0.0003"/></inertial></link>'
    )


def place(rng: random.Random) -> str:
    angles = " ".join(f"{rng.choice((0, 1.5707963, -1.5707963)):.7f}" for _ in range(3))
    offset = " ".join(f"{rng.uniform(-0.3, 0.3):.6f}" for _ in range(3))
    return f'<origin xyz="{offset}" rpy="{angles}"/>'


def joint(name: str, kind: str, parent: str, child: str, origin: str, axes: str) -> str:
    limit = '<limit lower="-3" upper="3" effort="100" velocity="10"/>' if kind in ("revolute", "prismatic") else ""
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{origin}{axes}{limit}</joint>'


def mechanism(name: str, bodies: int, branching: bool) -> str:
    """In chains each body carries one other body, in trees two."""
    rng = random.Random(bodies + branching)
    parts = ['<link name="l0"/>']
    for i in range(1, bodies + 1):
        parent = i // 2 if branching else i - 1
        parts += [link(f"l{i}", rng)]
        origin, axis = place(rng), rng.choice(("1 0 0", "0 1 0", "0 0 1"))
        parts += [joint(f"j{i}", "revolute", f"l{parent}", f"l{i}", origin, f'<axis xyz="{axis}"/>')]
    return f'<robot name="{name}">\n' + "\n".join(parts) + "\n</robot>\n"


def several_axes(name: str, one_axis: bool) -> str:
    """A tree of the joints of KINDS, or of the chains that stand for them, with massless links between."""
    rng = random.Random(KINDS_BODIES)
    own_axes = {"spherical": "", "universal": '<axis xyz="1 0 0"/><axis2 xyz="0 1 0"/>', "cylindrical": '<axis xyz="0 0 1"/>'}
    parts = ['<link name="l0"/>']
    for i in range(1, KINDS_BODIES + 1):
        kind, axes = list(KINDS.items())[i % len(KINDS)]
        parts.append(link(f"l{i}", rng))
        origin = place(rng)
        if not one_axis:
            parts.append(joint(f"j{i}", kind, f"l{i // 2}", f"l{i}", origin, own_axes[kind]))
            continue
        links = [f"l{i // 2}", *(f"l{i}_{k}" for k in range(1, len(axes))), f"l{i}"]
        parts += [f'<link name="{between}"/>' for between in links[1:-1]]
        for k, (one, axis) in enumerate(axes):
            parts.append(joint(f"j{i}_{k}", one, links[k], links[k + 1], "" if k else origin, f'<axis xyz="{axis}"/>'))
    return f'<robot name="{name}">\n' + "\n".join(parts) + "\n</robot>\n"


def main(output: str) -> None:
    folder = Path(output)
    (folder / "robots").mkdir(parents=True, exist_ok=True)
    share = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
    lines = [f"{name} {base} {share / path}" for name, (base, path) in EXAMPLES.items()]
    shapes = [("chain", n, False) for n in SIZES + LINEARITY] + [("tree", n, True) for n in SIZES]
    made = {f"{shape}{bodies}": mechanism(f"{shape}{bodies}", bodies, branching) for shape, bodies, branching in shapes}
    made |= {"kinds": several_axes("kinds", False), "kinds_by_axes": several_axes("kinds_by_axes", True)}
    for name, text in made.items():
        path = folder / f"robots/{name}.urdf"
        path.write_text(text)
        lines.append(f"{name} fixed {path.resolve()}")
    (folder / "robots.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
