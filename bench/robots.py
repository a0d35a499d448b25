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
    "anymal": ("floating", "anymal_b_simple_description/robots/anymal.urdf"),
    "talos": ("floating", "talos_data/robots/talos_reduced.urdf"),
}
SIZES = (4, 8, 16, 32, 64, 128)
LINEARITY = (250, 500, 1000)


def link(name: str, rng: random.Random) -> str:
    mass = rng.uniform(0.5, 2)
    x, y, z = (rng.uniform(-0.1, 0.1) for _ in range(3))
    a, b, c = (mass * rng.uniform(0.008, 0.012) for _ in range(3))  # near enough to each other for a real body
    return (
        f'<link name="{name}"><inertial><origin xyz="{x:.6f} {y:.6f} {z:.6f}"/><mass value="{mass:.6f}"/>'
        f'<inertia ixx="{a:.6f}" iyy="{b:.6f}" izz="{c:.6f}" ixy="0.0005" ixz="-0.0004" iyz="0.0003"/></inertial></link>'
    )


def joint(i: int, parent: int, rng: random.Random) -> str:
    angles = " ".join(f"{rng.choice((0, 1.5707963, -1.5707963)):.7f}" for _ in range(3))
    offset = " ".join(f"{rng.uniform(-0.3, 0.3):.6f}" for _ in range(3))
    axis = rng.choice(("1 0 0", "0 1 0", "0 0 1"))
    return (
        f'<joint name="j{i}" type="revolute"><parent link="l{parent}"/><child link="l{i}"/><origin xyz="{offset}" rpy="{angles}"/>'
        f'<axis xyz="{axis}"/><limit lower="-3" upper="3" effort="100" velocity="10"/></joint>'
    )


def mechanism(name: str, bodies: int, branching: bool) -> str:
    """In chains each body carries one other body, in trees two."""
    rng = random.Random(bodies + branching)
    parts = ['<link name="l0"/>']
    for i in range(1, bodies + 1):
        parent = i // 2 if branching else i - 1
        parts += [link(f"l{i}", rng), joint(i, parent, rng)]
    return f'<robot name="{name}">\n' + "\n".join(parts) + "\n</robot>\n"


def main(output: str) -> None:
    folder = Path(output)
    (folder / "robots").mkdir(parents=True, exist_ok=True)
    share = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
    lines = [f"{name} {base} {share / path}" for name, (base, path) in EXAMPLES.items()]
    shapes = [("chain", n, False) for n in SIZES + LINEARITY] + [("tree", n, True) for n in SIZES]
    for shape, bodies, branching in shapes:
        path = folder / f"robots/{shape}{bodies}.urdf"
        path.write_text(mechanism(path.stem, bodies, branching))
        lines.append(f"{path.stem} fixed {path.resolve()}")
    (folder / "robots.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
