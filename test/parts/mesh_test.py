"""Meshes of parts: volume, first moment and inertia in closed form, forces of the elements, and what is refused."""

import numpy as np
import pytest
from bricks import bar

import ksl
from ksl.parts.elements import HEXAHEDRON_CORNERS, KINDS
from ksl.parts.mesh import read_mesh

SIZE, COUNTS = np.array([0.4, 0.03, 0.02]), (4, 1, 2)
KIND = pytest.mark.parametrize("kind", ["C3D4", "C3D10", "C3D8", "C3D20R"])


@KIND
def test_a_bar_has_the_inertia_of_the_formula(tmp_path, kind):
    volume, first, inertia = read_mesh(bar(tmp_path / "bar.inp", kind, SIZE, COUNTS)).inertia()
    L, b, h = SIZE
    V = L * b * h
    np.testing.assert_allclose(volume, V, rtol=1e-13)
    np.testing.assert_allclose(first, [V * L / 2, 0, 0], rtol=1e-13, atol=1e-18)
    np.testing.assert_allclose(inertia, np.diag([(b * b + h * h) / 12, L * L / 3 + h * h / 12, L * L / 3 + b * b / 12]) * V, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("kind", ["C3D10", "C3D20"])
def test_a_bent_bar_has_the_inertia_of_the_formula(tmp_path, kind):
    """Bent by y + d (x/L)²: its volume is that of the bar, and ∫ y dV = V d/3, ∫ y² dV = V (b²/12 + d²/5).  One element spans the length, so that it holds the curve."""
    d, (L, b, h) = 0.05, SIZE
    volume, first, inertia = read_mesh(bar(tmp_path / "bar.inp", kind, SIZE, (1, 1, 2), bend=d)).inertia()
    V = L * b * h
    np.testing.assert_allclose([volume, first[1]], [V, V * d / 3], rtol=1e-12)
    np.testing.assert_allclose(inertia[0, 0], V * (b * b / 12 + d * d / 5 + h * h / 12), rtol=1e-12)
    np.testing.assert_allclose(inertia[0, 1], -V * L * d / 4, rtol=1e-12)


@KIND
def test_shape_functions_are_one_at_their_node_and_their_slopes_are_theirs(kind):
    of = KINDS[kind]
    nodes = HEXAHEDRON_CORNERS if of.corners == 8 else np.vstack([np.zeros(3), np.eye(3)])
    nodes = np.vstack([nodes, *([(nodes[a] + nodes[b])[None] / 2 for a, b in of.edges] if of.nodes > of.corners else [])])
    np.testing.assert_allclose(of.shape(nodes), np.eye(of.nodes), atol=1e-15)
    x, step = np.array([[0.21, 0.32, 0.13]]), 1e-6
    for i in range(3):
        by_difference = (of.shape(x + step * np.eye(3)[i]) - of.shape(x - step * np.eye(3)[i])) / (2 * step)
        np.testing.assert_allclose(of.slope(x)[..., i], by_difference, atol=1e-9)
    np.testing.assert_allclose(of.shape(x).sum(), 1, rtol=1e-14)


@KIND
def test_faces_of_a_set_are_on_its_end(tmp_path, kind):
    mesh = read_mesh(bar(tmp_path / "bar.inp", kind, SIZE, COUNTS))
    faces, nodes = mesh.faces_of(mesh.named("Tip"))
    assert len(faces) == COUNTS[1] * COUNTS[2] * (1 if KINDS[kind].corners == 8 else 2)
    assert np.array_equal(nodes, mesh.named("tip")) and np.allclose(mesh.points[nodes, 0], SIZE[0])
    assert len(mesh.boundary) == 2 * (4 * 1 + 4 * 2 + 1 * 2) * (1 if KINDS[kind].corners == 8 else 2), "of the whole surface"


def test_sets_by_ranges_by_other_sets_and_by_faces(tmp_path):
    text = bar(tmp_path / "bar.inp", "C3D8", SIZE, (1, 1, 1)).read_text()
    text += (
        "*NSET, NSET=some, GENERATE\n11, 17, 2\n*NSET, NSET=more\nsome, 12\n*ELEMENT, TYPE=S4, ELSET=face\n90, 11, 12, 13, 14\n*SOLID SECTION, ELSET=solid\n"
    )
    (tmp_path / "more.inp").write_text(text)
    mesh = read_mesh(tmp_path / "more.inp")
    numbers = {name: mesh.numbers[rows].tolist() for name, rows in mesh.sets.items()}
    assert numbers["SOME"] == [11, 13, 15, 17] and numbers["MORE"] == [11, 12, 13, 15, 17] and numbers["FACE"] == [11, 12, 13, 14]
    assert [block.kind for block in mesh.blocks] == ["C3D8"]


BAD = {
    "no elements": (lambda text: text.partition("*Element")[0], "has no solid elements"),
    "wedges": (lambda text: text.replace("C3D8", "C3D6"), "elements C3D6 are not read; mesh the part with tetrahedra or hexahedra"),
    "a node that is missing": (lambda text: text.replace("11, 0.0", "99, 0.0", 1), "node 11 of an element isn't there"),
    "words": (lambda text: text.replace("11, 0.0", "11, zero", 1), r"\*NODE at line 2 holds something else than numbers"),
    "inside out": (
        lambda text: text.replace(text.splitlines()[11], "1, 15, 16, 17, 18, 11, 12, 13, 14"),
        "element 1 (.*) is turned inside out or has no volume",
    ),
    "included": (lambda text: text + "*INCLUDE, INPUT=other.inp\n", r"has \*INCLUDE, which is not followed"),
    "not finite": (lambda text: text.replace("11, 0.0", "11, nan", 1), "a coordinate isn't finite"),
}


@pytest.mark.parametrize(("change", "said"), BAD.values(), ids=BAD)
def test_what_is_no_mesh_is_refused(tmp_path, change, said):
    file = bar(tmp_path / "bar.inp", "C3D8", SIZE, (1, 1, 1))
    file.write_text(change(file.read_text()))
    with pytest.raises(ksl.PartError, match=said):
        read_mesh(file).inertia()


def test_any_text_is_read_or_refused_with_a_sentence(tmp_path):
    """Lines and characters that are swapped, dropped and changed; numbers that are huge; ranges without end."""
    rng = np.random.default_rng(0)
    text = bar(tmp_path / "bar.inp", "C3D8", SIZE, (1, 1, 1)).read_text()
    words = [
        "99999999999999999999999",
        "-1",
        "1e400",
        "nan",
        "0",
        "",
        "*NSET, NSET=a, GENERATE\n1, 999999999999999, 1",
        "*NSET, GENERATE\n1, 9, 0",
        "*ELEMENT",
        "*",
        "C3D20",
        "\ud800".encode("utf-8", "replace").decode(),
    ]
    refused = 0
    for _ in range(400):
        parts = text.replace(",", ",\0").replace("\n", "\n\0").split("\0")
        for _ in range(rng.integers(1, 4)):
            i, j = rng.integers(len(parts), size=2)
            parts[i] = (parts[j], parts[i] + parts[j], words[rng.integers(len(words))] + parts[i][-1:], "")[rng.integers(4)]
        (tmp_path / "any.inp").write_text("".join(parts), errors="replace")
        try:
            read_mesh(tmp_path / "any.inp").inertia()
        except ksl.PartError:
            refused += 1
    assert refused > 100


def test_a_file_that_is_none(tmp_path):
    with pytest.raises(ksl.PartError, match="can't be read .*give the mesh of a part as an .inp file"):
        read_mesh(tmp_path)
