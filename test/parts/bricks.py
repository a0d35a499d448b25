"""Meshes of bars as .inp files, with sets of nodes at both ends: hexahedra, or each of them cut into six tetrahedra."""

import itertools

import numpy as np

from ksl.parts.elements import HEXAHEDRON_CORNERS, HEXAHEDRON_EDGES, TETRAHEDRON_EDGES

CUT = [(0, *path, 6) for path in ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))]
"""Six tetrahedra around the diagonal of a hexahedron."""


def bar(path, kind, size, counts, bend=0.0, prefix=""):
    """Writes a bar from x = 0, its middle on the x axis; bend: how far it is bent along y, a curve of second order.  Returns the path."""
    corners = np.array(list(itertools.product(*(range(n + 1) for n in counts))))
    index = {tuple(2 * c): i for i, c in enumerate(corners.tolist()) for c in [np.array(c)]}
    points = [tuple(2 * np.array(c)) for c in corners.tolist()]
    elements = []
    for cell in itertools.product(*(range(n) for n in counts)):
        at = [tuple((2 * np.array(cell) + c + 1).astype(int)) for c in HEXAHEDRON_CORNERS]
        groups = [(at, HEXAHEDRON_EDGES)] if kind.startswith(("C3D8", "C3D20")) else [([at[i] for i in four], TETRAHEDRON_EDGES) for four in CUT]
        for own, edges in groups:
            nodes = list(own)
            if kind.startswith(("C3D10", "C3D20")):
                nodes += [tuple((np.array(own[a]) + np.array(own[b])) // 2) for a, b in edges]
            for node in nodes:
                if node not in index:
                    index[node] = len(points)
                    points.append(node)
            elements.append([index[node] + 11 for node in nodes])
    x = np.array(points) / (2 * np.array(counts)) * size - [0, size[1] / 2, size[2] / 2]
    x[:, 1] += bend * (x[:, 0] / size[0]) ** 2
    ends = {"root": [i + 11 for i, p in enumerate(points) if p[0] == 0], "tip": [i + 11 for i, p in enumerate(points) if p[0] == 2 * counts[0]]}
    lines = ["** a bar", "*NODE", *(f"{i + 11}, {', '.join(map(repr, row))}" for i, row in enumerate(x.tolist())), f"*Element, type={kind}, elset=solid"]
    for number, nodes in enumerate(elements, 1):
        words = [str(n) for n in (number, *nodes)]
        lines += [", ".join(words[:14]) + ("," if len(words) > 14 else ""), *([", ".join(words[14:])] if len(words) > 14 else [])]
    for name, nodes in ends.items():
        lines += [f"*NSET, NSET={prefix}{name}", *(", ".join(map(str, nodes[i : i + 8])) for i in range(0, len(nodes), 8))]
    path.write_text("\n".join(lines) + "\n")
    return path
