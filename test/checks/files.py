"""Small robot files for the tests: a sound one, and the same with one thing changed."""

ARM = """<?xml version="1.0"?>
<!-- an arm -->
<robot name="arm">
  <link name="stand"/>
  <link name="upper">
    <inertial>
      <origin xyz="0 0 0.2"/>
      <mass value="2"/>
      <inertia ixx="0.0283" iyy="0.0283" izz="0.0033" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision>
      <origin xyz="0 0 0.2"/>
      <geometry><box size="0.1 0.1 0.4"/></geometry>
    </collision>
  </link>
  <link name="fore">
    <inertial>
      <origin xyz="0 0 0.15"/>
      <mass value="1"/>
      <inertia ixx="0.0083" iyy="0.0084" izz="0.0017" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="stand"/>
    <child link="upper"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1.5" upper="1.5" effort="80" velocity="2"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/>
    <child link="fore"/>
    <origin xyz="0 0 0.4"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="50" velocity="2"/>
  </joint>
</robot>
"""
"""No rule has anything to say about it.  The upper arm is a bar of 2 kg: m (a² + b²)/12 = 0.0283 and 0.0033 kg m²."""

END = "</robot>"


def changed(*pairs: tuple[str, str], text: str = ARM) -> str:
    """The arm with texts replaced, each of which stands in it."""
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return text


def link(name: str, mass: float = 1.0, inside: str = "", moments: str | None = None) -> str:
    """A link whose moments are of a part of a fixed size."""
    if moments is None:
        xx, yy, zz = (f"{x * (mass or 1.0):g}" for x in (0.011, 0.012, 0.013))
        moments = f'ixx="{xx}" iyy="{yy}" izz="{zz}"'
    return f"""<link name="{name}"><inertial><mass value="{mass}"/><inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial>{inside}</link>"""


def hinge(name: str, parent: str, child: str, inside: str = "", kind: str = "revolute") -> str:
    limit = '<limit lower="-1" upper="1" effort="9" velocity="2"/>' if kind in ("revolute", "prismatic") else ""
    axis = "" if kind == "fixed" else '<axis xyz="0 0 1"/>'
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{axis}{limit}{inside}</joint>'


def more(*elements: str, text: str = ARM) -> str:
    """The arm with more elements."""
    return text.replace(END, "\n".join(elements) + "\n" + END)


def stl(triangles: int = 2, size: float = 0.1, declared: int | None = None) -> bytes:
    """A binary STL file whose corners span a cube of this size around the origin."""
    import numpy as np

    record = np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("attribute", "<u2")])
    data = np.zeros(triangles, record)
    data["points"][:, 0], data["points"][:, 1], data["points"][:, 2] = (-size / 2, size / 2, [[0, 0, size / 2]] * triangles)
    count = triangles if declared is None else declared
    return b"made by a test".ljust(80) + count.to_bytes(4, "little") + data.tobytes()
