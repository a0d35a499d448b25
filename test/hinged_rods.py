"""Rods on hinges, as robot files and as joints, and files of cases beside their motions."""

from ksl.load_cases.case_files.case_file import cases_of_text
from ksl.load_cases.verdict import Use
from ksl.mechanism.mechanism import Joint

LIMITS = {"lower": -1.0, "upper": 3.0, "velocity": 4.0, "effort": 20.0}


def joint_of(name="pin", kind="revolute", angle=True, **more) -> Joint:
    return Joint(name, kind, "wall", "rod", 1, 1, 0, 0, (0.0, 1.0, 0.0), has_axis=True, has_angle=angle, has_limits=True, **more)


def use(share, quantity="effort", case="a", name="pin", column=None):
    return Use(case, name, quantity, column or name, share, 20 * share, 20.0, "effort", "N m", 0.5)


BODY = '<link name="{}"><inertial><origin xyz="0.5 0 0"/><mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>'
HINGE = '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><axis xyz="0 0 1"/>{}</joint>'
ROD = f'<robot name="r"><link name="wall"/>{BODY.format("rod")}{HINGE.format("pin", "continuous", "wall", "rod", "")}</robot>'


def files_beside(folder):
    """A motion of the rod with a speed of 4 rad/s at its first sample, and a table of wrenches whose last line may be cut off."""
    (folder / "m.csv").write_text("time,pin,pin.v,pin.a\n" + "".join(f"{k / 2},{k / 9},{4 - k / 2},-1\n" for k in range(7)))
    (folder / "w.csv").write_text("time,fz,tx\n0,1,2\n1,3,4")
    return lambda m, keys, name="a", **more: cases_of_text(m, f"[cases.{name}]\n{keys}\n", str(folder / "c.toml"), **more)
