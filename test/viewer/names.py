"""Names that files may have: those that would run in a page, and those that KSL has itself."""

from xml.sax.saxutils import quoteattr as q

HOSTILE = [
    "<img src=x onerror=alert(1)>", '"><script>alert(1)</script>', "' onmouseover='alert(1)", "</script><script>alert(1)</script>", "<svg/onload=alert(1)>",
    "![a](http://evil.example/m.png)", "[a](javascript:alert(1))", "{alert(1)}", '<a href="javascript:alert(1)">x</a>', "http://evil.example/bare",
    "www.evil.example", "$\\href{javascript:alert(1)}{x}$", "%{x}<extra></extra>", "a<br>b</title>", "*/alert(1)//", "\u202egnp.exe", "=HYPERLINK(1)", "&#60;b&#62;",
]  # fmt: skip
"""What HTML, Markdown, SVG, JSON, TeX, plotly, style sheets, terminals or spreadsheets might take for more than text."""

OURS = [
    "world",
    "base",
    "case",
    "joint",
    "total",
    "offset",
    "-",
    "Arm",
    "arm",
    "a/b",
    "a_b",
    "x" * 300,
    "x" * 299 + "y",
    "🦾",
    " ",
    "links",
    "structure",
    "constructor",
]
"""Words of KSL's own pages, tables and options; equal but for case or for what a tree of nodes separates; long ones; pictures."""

INERTIAL = '<inertial><origin xyz="0.05 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'


def chain(names: list[str], robot: str = "chain", root: str = "root") -> str:
    """URDF of a chain: links of these names behind the root, each with a mesh that is not there, and joints of the same names."""
    mesh = "<visual><geometry><mesh filename={}/></geometry></visual>"
    links = "".join(f"<link name={q(n)}>{INERTIAL}{mesh.format(q(f'{n}.stl')) if k < 4 else ''}</link>" for k, n in enumerate([root, *names]))
    limit = '<limit lower="-1" upper="1" effort="9" velocity="9"/>'
    joints = "".join(
        f'<joint name={q(b)} type="revolute"><origin xyz="0.1 0 0"/><axis xyz="0 1 0"/><parent link={q(a)}/><child link={q(b)}/>{limit}</joint>'
        for a, b in zip([root, *names], names)
    )
    return f"<robot name={q(robot)}>{links}{joints}</robot>"
