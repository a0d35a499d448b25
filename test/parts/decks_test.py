"""Decks as solvers read them: all that they load a bar with sums up to nothing, in either units; how they hold it; what is refused."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from bricks import bar
from swinging_bar import MASS, RHO, SIZE, bar_cases, bar_model

import ksl
from ksl.parts.nastran import _number
from ksl.parts.part_loads import DeckOptions
from ksl.parts.units import Material

SETS = {"hinge": "root", "tip": "tip"}
STEEL = Material(2.1e11, 0.3, RHO)
LENGTH = {"m-kg-s": 1.0, "mm-t-s": 1000.0}


def deck_of(folder, solver="calculix", units="m-kg-s", kind="C3D10", cases=None, **options):
    """The text of a deck, and what the writer says of it."""
    mesh = bar(folder / "bar.inp", kind, SIZE * LENGTH[units], (6, 1, 1))
    cases = bar_cases() if cases is None else cases
    said = {"sets": SETS, "material": STEEL, "units": units} | options
    names = cases.write(folder / "out", solver, {"bar": mesh}, DeckOptions(**said))
    return (folder / "out" / names[-1]).read_text(), cases.deck_notes


def cards(text):
    """{keyword with its options: rows of words}, of a deck for CalculiX."""
    found = {}
    for line in text.splitlines():
        if line.startswith("*") and not line.startswith("**"):
            rows = found.setdefault(line, [])
        elif not line.startswith("**") and found:
            rows.append([word.strip() for word in line.split(",") if word.strip()])
    return found


def by_motion(fall, omega2, axis, length):
    """Force and moment of gravity and of turning on the bar, in closed form."""
    L, b, h = SIZE * length
    m, first = MASS * (1 if length == 1 else 1e-3), np.array([L / 2, 0, 0])
    second = np.diag([L * L / 3, b * b / 12, h * h / 12]) * m  # ∫ r rᵀ dm
    spin = omega2 * (np.eye(3) - np.outer(axis, axis))
    force, moment = m * fall + spin @ (m * first), np.cross(m * first, fall)
    about = spin @ second  # ∫ (spin r) rᵀ dm
    return force, moment - np.array([about[1, 2] - about[2, 1], about[2, 0] - about[0, 2], about[0, 1] - about[1, 0]])


def total(text, length):
    """The sum of everything in the only step of a deck for CalculiX: (6), and the largest force."""
    found = cards(text)
    at = {int(row[0]): np.array(row[1:4], dtype=float) for key, rows in found.items() if key.startswith("*NODE, NSET") for row in rows}
    force, moment, largest = np.zeros(3), np.zeros(3), 0.0
    for node, dof, value in found["*CLOAD, OP=NEW"]:
        x = float(value) * np.eye(3)[(int(dof) - 1) % 3]
        largest = max(largest, abs(float(value)))
        force, moment = (force + x, moment + np.cross(at[int(node)], x)) if int(dof) <= 3 else (force, moment + x)
    fall, omega2, axis = np.zeros(3), 0.0, np.array([0, 0, 1.0])
    for _, kind, *row in found["*DLOAD, OP=NEW"]:
        x = np.array(row, dtype=float)
        if kind == "GRAV":
            fall = x[0] * x[1:]
        else:
            omega2, axis = x[0], x[4:]
            assert not x[1:4].any()
    of_body = by_motion(fall, omega2, axis, length)
    return np.r_[force + of_body[0], (moment + of_body[1]) / length], largest


@pytest.mark.parametrize("units", LENGTH)
@pytest.mark.parametrize("kind", ["C3D10", "C3D20R", "C3D4", "C3D8"])
def test_a_deck_of_calculix_is_in_balance(tmp_path, units, kind):
    """With gravity, turning and angular acceleration, whose forces the elements distribute; the bar's own mass in closed form."""
    text, notes = deck_of(tmp_path, units=units, kind=kind)
    left, largest = total(text, LENGTH[units])
    assert np.abs(left).max() < 1e-8 * largest and largest > 50
    assert len(notes) == 1 and f"the mesh has {MASS:.4g} kg (7850 kg/m³), the link {MASS:.4g} kg" in notes[0]
    assert float(re.search(r"their centres are (\S+) mm apart", notes[0])[1]) < 1e-9
    np.testing.assert_allclose(float(cards(text)["*ELASTIC"][0][0]), 2.1e11 if units == "m-kg-s" else 2.1e5, rtol=1e-9)  # Pa or MPa


def test_a_deck_says_where_it_comes_from_and_has_a_step_for_each_case(tmp_path):
    text, _ = deck_of(tmp_path, cases=bar_cases(times=(0.0, 1.0)))
    assert text.count("*STEP") == text.count("*END STEP") == 2 and text.count("OP=NEW") == 4
    head = text.partition("*NODE")[0]
    assert "** ksl " in head and "** robot: swing" in head and "** units: m, kg, s" in head and "** bar 1: motion at 0 s, given" in text


def test_what_holds_the_bar_is_just_enough(tmp_path):
    """Six directions at three nodes that no wrench acts on: the six rigid motions move them, each otherwise."""
    text, _ = deck_of(tmp_path)
    found = cards(text)
    at = {int(row[0]): np.array(row[1:4], dtype=float) for row in found["*NODE, NSET=PART_NODES"]}
    rows = [np.r_[np.eye(3)[int(d) - 1], np.cross(at[int(n)], np.eye(3)[int(d) - 1])] for n, d, _ in found["*BOUNDARY"]]
    assert len(rows) == 6 and abs(np.linalg.det(rows)) > 1e-5 * SIZE[0] ** 2 * SIZE[1]
    on = {n for key, rows in found.items() if key.startswith("*NSET, NSET=ON_") for row in rows for n in row}
    assert not on & {row[0] for row in found["*BOUNDARY"]}
    cards_of_nastran = [line.split()[1:] for line in deck_of(tmp_path, "nastran")[0].splitlines() if line.startswith("SPC1")]
    assert cards_of_nastran == [["1", dof, node] for node, dof, _ in found["*BOUNDARY"]]


def test_nodes_of_elements_go_on_behind_a_comma(tmp_path):
    """20 nodes need two lines: of 16 numbers at most each."""
    text, _ = deck_of(tmp_path, kind="C3D20R")
    block = text.partition("*ELEMENT, TYPE=C3D20R, ELSET=PART\n")[2].partition("\n*")[0]
    assert max(len(line.rstrip(",").split(",")) for line in block.splitlines()) <= 16
    assert [len(element.split(",")) for element in block.replace(",\n", ",").splitlines()] == 6 * [21]


@pytest.mark.parametrize("units", LENGTH)
def test_a_deck_of_nastran_is_in_balance(tmp_path, units):
    length = LENGTH[units]
    text, _ = deck_of(tmp_path, "nastran", units)
    lines, at, force, moment, fall, omega2, axis = text.splitlines(), {}, np.zeros(3), np.zeros(3), np.zeros(3), 0.0, np.eye(3)[2]
    for i, line in enumerate(lines):
        card, words = (
            line[:8].strip(),
            [line[k : k + 16].strip() for k in range(8, 72, 16)] + [lines[min(i + 1, len(lines) - 1)][k : k + 16].strip() for k in range(8, 72, 16)],
        )
        if card == "GRID*":
            at[words[0]] = np.array([float(x) for x in words[2:5]])
        elif card in ("FORCE*", "MOMENT*"):
            assert words[0] == "10001"
            x = float(words[3]) * np.array([float(w) for w in words[4:7]])
            force, moment = (force + x, moment + np.cross(at[words[1]], x)) if card == "FORCE*" else (force, moment + x)
        elif card == "GRAV*":
            fall = float(words[2]) * np.array([float(w) for w in words[3:6]])
        elif card == "RFORCE*":
            omega2, axis = (2 * np.pi * float(words[3])) ** 2, np.array([float(w) for w in words[4:7]])
    of_body = by_motion(fall, omega2, axis, length)
    left = np.r_[force + of_body[0], (moment + of_body[1]) / length]
    assert np.abs(left).max() < 1e-6 and omega2 == pytest.approx(144, rel=1e-8)
    assert next(line for line in lines if line.startswith("LOAD ")).split() == "LOAD 1 1.0 1.0 10001 1.0 20001 1.0 30001".split()
    relieved, _ = deck_of(tmp_path, "nastran", units, relief=True)
    assert "PARAM,INREL,-2" in relieved and not any(card in relieved for card in ("GRAV*", "SPC1", "SPC = 1"))


def test_cards_of_nastran_have_eight_fields_and_its_order_of_nodes(tmp_path):
    """Of 20 nodes the ones in the middles of edges: four around the bottom, four upright, four around the top.  What carries a wrench distributes all six of it, by forces at nodes."""
    lines, at, cards_of = deck_of(tmp_path, "nastran", kind="C3D20R")[0].splitlines(), {}, []
    for line, following in zip(lines, [*lines[1:], ""]):
        if line.startswith("GRID*"):
            at[line[8:24].strip()] = np.array([float(x) for x in (line[40:56], line[56:72], following[8:24])])
        fields = [line[k : k + 8].strip() for k in range(8, len(line), 8)]
        if line.startswith(("CHEXA ", "RBE3 ")):
            cards_of.append([line[:8].strip()])
        if line.startswith(("CHEXA ", "RBE3 ", "+ ")):
            assert len(line) <= 72
            cards_of[-1] += fields
    bricks = [card[3:] for card in cards_of if card[0] == "CHEXA"]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)]
    for nodes in bricks:
        for (a, b), middle in zip(edges, nodes[8:], strict=True):
            np.testing.assert_allclose(at[middle], (at[nodes[a]] + at[nodes[b]]) / 2, atol=1e-9)
    assert len(bricks) == 6 and [card[2:7] for card in cards_of if card[0] == "RBE3"] == [
        ["", card[3], "123456", "1.0", "123"] for card in cards_of if card[0] == "RBE3"
    ]


def test_a_mesh_of_another_mass_leaves_a_share_to_the_nodes_that_hold_it_or_is_relieved(tmp_path):
    heavy = bar_cases(mass=2 * MASS)
    text, notes = deck_of(tmp_path, cases=heavy)
    left, largest = total(text, 1.0)
    assert np.abs(left).max() > 0.01 * largest and "three nodes hold up to" in notes[1] and "relief" in notes[1]
    assert f"hold up to {np.linalg.norm(left[:3]):.3g} N and {np.linalg.norm(left[3:]):.3g} N m that" in notes[1]
    hinge, tip = (np.linalg.norm(w.wrench[:3]) for w in heavy[0].bodies["bar"].wrenches)
    assert f"of {max(hinge, tip):.4g} N at the joints" in notes[1]
    text, notes = deck_of(tmp_path, cases=heavy, relief=True)
    assert np.abs(total(text, 1.0)[0]).max() < 1e-8 * largest and len(notes) == 1
    text, notes = deck_of(tmp_path, cases=heavy, material=Material())
    assert np.abs(np.subtract(float(cards(text)["*DENSITY"][0][0]), 2 * RHO)) < 1e-6, "the link's mass over the mesh's volume"


def test_rigid_bodies_have_a_node_for_rotations_in_calculix(tmp_path):
    of_nodes = lambda text: {(int(n), int(dof)): value for n, dof, value in cards(text)["*CLOAD, OP=NEW"]}
    found, other = of_nodes(deck_of(tmp_path, coupling="rigid")[0]), of_nodes(deck_of(tmp_path)[0])
    moments = {key: value for key, value in other.items() if key[1] > 3}
    assert len(moments) == 6 and found == {(n, dof) if dof <= 3 else (n + 1, dof - 3): value for (n, dof), value in other.items()}
    assert "*KINEMATIC" in deck_of(tmp_path, "abaqus", coupling="rigid")[0]


def test_without_a_mesh_there_are_loads_alone(tmp_path):
    cases = bar_cases()
    names = cases.write(tmp_path, ["calculix", "nastran"])
    text = (tmp_path / "bar_calculix.inp").read_text()
    assert (
        names[-2:] == ["bar_calculix.inp", "bar_nastran.bdf"]
        and "include this file behind a mesh" in text
        and "*ELEMENT" not in text
        and "*BOUNDARY" not in text
    )
    rows = list(csv.DictReader(line for line in (tmp_path / "free_bodies.csv").read_text().splitlines() if line[0] != "#"))
    assert list(rows[0]) == "case load_case link frame kind name time x y z fx fy fz tx ty tz undetermined".split() and [row["kind"] for row in rows[-2:]] == [
        "gravity",
        "inertia",
    ]
    x = np.array([[float(row[name]) for name in list(row)[7:16]] for row in rows])
    assert np.abs(np.c_[x[:, 3:6], x[:, 6:] + np.cross(x[:, :3], x[:, 3:6])].sum(axis=0)).max() < 1e-10 and not x[-2:, :3].any()
    assert "SURFACE=SURFACE_HINGE" in text and "its forces need a mesh" in text and "without a mesh" in cases.deck_notes[0]


BAD = {
    "a set": ({"sets": {"hinge": "rot"}}, "no node set 'rot'; did you mean 'ROOT'. it has SOLID, ROOT, TIP; say on which set hinge of bar acts"),
    "millimetres": (
        {"units": "mm-t-s"},
        "the mesh is .* mm large, and the points of bar at which loads act are .* mm apart; is it in m. then take the units m-kg-s",
    ),
    "a radius": ({"radius": {"hinge": 20.0}}, "radius of hinge: 20 m, and the part is .* m large; radii are in m"),
    "too near": ({"radius": {"hinge": 0.001}}, "no face of the surface has all its nodes within 0.001 m of hinge; its point is .* m from the nearest node"),
    "one set of two rigid bodies": ({"sets": {"hinge": "root", "tip": "root"}, "coupling": "rigid"}, "hinge and tip act on the same nodes"),
    "all nodes": ({"sets": {"hinge": "solid", "tip": "tip"}}, "the sets take all nodes but 0"),
    "a set of no wrench": ({"sets": SETS | {"hing": "root"}}, "sets: the parts: no wrench named 'hing'; did you mean 'hinge'"),
    "units": ({"units": "inch"}, "units='inch'; expected one of 'm-kg-s', 'mm-t-s'"),
    "MPa": ({"material": Material(210000.0)}, "young=210000 Pa is less than rubber has; is it in MPa"),
    "t/mm³": ({"material": Material(density=7.85e-9)}, "is it in t/mm³"),
    "rubber": ({"material": Material(poisson=0.5)}, "poisson=0.5"),
}


@pytest.mark.parametrize(("options", "said"), BAD.values(), ids=BAD)
def test_what_makes_no_deck_is_said(tmp_path, options, said):
    mesh = bar(tmp_path / "bar.inp", "C3D10", SIZE, (6, 1, 1))
    with pytest.raises(ValueError, match=said):
        bar_cases().write(tmp_path / "out", "calculix", {"bar": mesh}, DeckOptions(**{"sets": SETS} | options))
    assert not (tmp_path / "out").exists()


def test_a_mesh_asks_for_a_deck_and_names_make_no_lines_of_their_own(tmp_path):
    mesh = bar(tmp_path / "bar.inp", "C3D8", SIZE, (2, 1, 1))
    b = (
        ksl.Builder("swing")
        .add_link("base")
        .add_link("bar, *STEP", 1.0, (0.2, 0, 0), np.eye(3))
        .add_joint("hinge", "revolute", "base", "bar, *STEP", axis=(0, 1, 0))
    )
    case = replace(ksl.compute_loads(b.build(), (np.arange(2.0), *np.ones((3, 2, 1)))).cases[0], name="a\n*STEP")
    names = ksl.free_bodies(ksl.compute_loads(b.build(), cases=[case]), times=[0], links=["bar, *STEP"]).write(
        tmp_path, meshes={"bar, *STEP": mesh}, options=DeckOptions(sets={"hinge": "root"})
    )
    assert names[-1] == "bar___STEP_calculix.inp" and (tmp_path / names[-1]).read_text().splitlines().count("*STEP") == 1


def test_a_radius_takes_the_surface_around_the_point(tmp_path):
    text, _ = deck_of(tmp_path, radius={"hinge": 0.02})
    found = cards(text)
    assert len(found["*SURFACE, NAME=SURFACE_HINGE, TYPE=ELEMENT"]) == 2, "both triangles of the end"


def test_meshes_of_links_without_free_body(tmp_path):
    with pytest.raises(ksl.PartError, match="meshes: no body named 'rod'"):
        bar_cases().write(tmp_path, "calculix", {"rod": "rod.inp"})
    with pytest.raises(ksl.PartError, match="'ansys' is none of calculix, abaqus, nastran; users of other programs import free_bodies.csv"):
        bar_cases().write(tmp_path, "ansys")


def test_a_load_case_without_a_wrench_of_two_with_one_name_keeps_the_other(tmp_path):
    """A payload and a wrench of the environment on one link have its name: where the second is missing the deck still has the first."""
    still = np.zeros((2, 1))
    cases = []
    for name, external in (("free", None), ("pushed", {"tip": np.array([3.0, 0, 0, 0, 0, 0])})):
        run = ksl.compute_loads(bar_model(), (np.array([0.0, 1.0]), still, still, still), payloads={"tip": (2.0, (0, 0, 0))}, external=external)
        cases.append(replace(run.cases[0], name=name))
    ksl.free_bodies(ksl.compute_loads(run.model, cases=cases), times=[0], links=["bar"]).write(tmp_path, "abaqus")
    loads = cards((tmp_path / "bar_abaqus.inp").read_text())["*CLOAD, OP=NEW"]  # of both steps
    assert len([float(x) for _, dof, x in loads if dof == "3" and np.isclose(float(x), -2 * 9.81)]) == 2, loads


def test_numbers_of_nastran_have_sixteen_characters():
    assert [len(_number(x)) for x in (-1.5, -1e-120, 5e-324, -9.9e98)] == [16] * 4 and float(_number(-1e-120)) == 0
