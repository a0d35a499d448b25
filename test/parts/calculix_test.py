"""Decks in the solver itself: CalculiX (`ccx`, of the Debian package calculix-ccx) on bars, beside the formulas of beams.  Without it these tests are left out."""

import shutil
import subprocess

import numpy as np
import pytest
from bricks import bar
from swinging_bar import RHO, SIZE, bar_cases

from ksl.parts.mesh import read_mesh
from ksl.parts.part_loads import DeckOptions, part_loads
from ksl.parts.units import SYSTEMS, Material

pytestmark = [pytest.mark.long, pytest.mark.skipif(shutil.which("ccx") is None, reason="needs CalculiX, `ccx`")]
SETS = {"hinge": "root", "tip": "tip"}
YOUNG = 2.1e11
COUNTS = (40, 3, 2)


def solved(folder, cases, kind, units, coupling, turned=False):
    """What CalculiX finds: the part, forces at the holding nodes less the shares of body loads, stresses of elements at points of integration, and displacements, in SI units.

    turned: the part is held at other nodes."""
    length = SYSTEMS[units].length
    mesh_file = bar(folder / "bar.inp", kind, SIZE * length, COUNTS)
    options = DeckOptions(units, Material(YOUNG, 0.0, RHO), SETS, coupling=coupling)
    cases.write(folder / "out", "calculix", {"bar": mesh_file}, options, force=True)
    part = part_loads(cases, "bar", read_mesh(mesh_file), options)
    text = (folder / "out" / "bar_calculix.inp").read_text()
    held = [part.mesh.numbers[row] for row, _ in part.holding]
    if turned:
        text, held = held_elsewhere(text, part)
    text = text.replace("*STEP", "*NSET, NSET=HELD\n" + ", ".join(map(str, dict.fromkeys(held))) + "\n*STEP", 1)
    text = text.replace(
        "*NODE FILE", "*NODE PRINT, NSET=HELD\nRF\n*NODE PRINT, NSET=PART_NODES\nU\n*EL PRINT, ELSET=PART\nS\n*EL PRINT, ELSET=PART\nCOORD\n*NODE FILE"
    )
    (folder / "run.inp").write_text(text)
    done = subprocess.run(["ccx", "run"], cwd=folder, capture_output=True, text=True, timeout=300)
    assert "*ERROR" not in done.stdout, done.stdout[-2000:]
    forces, moved, stress, points = {}, {}, [], []
    found = forces
    for line in (folder / "run.dat").read_text().splitlines():
        words = line.split()
        tables = {" forces": forces, " displacements": moved, " stresses": stress, " global coordinates": points}
        found = next((table for head, table in tables.items() if line.startswith(head)), found)
        if words and words[0].isdigit():
            x = [float(w) for w in words]
            found.append(x) if isinstance(found, list) else found.update({int(x[0]): np.array(x[1:])})
    body, row = body_forces(part, part.cases[0]), {n: i for i, n in enumerate(part.mesh.numbers.tolist())}
    left = np.array([f - body[row[n]] for n, f in forces.items()])
    units_of = SYSTEMS[units]
    at = part.mesh.points / length
    u = np.array([moved[n] for n in part.mesh.numbers.tolist()]) / length
    return left / units_of.force, np.column_stack([np.array(points)[:, 2:] / length, np.array(stress)[:, 2:] / units_of.stress]), at, u


def body_forces(part, case):
    """(nodes, 3): all that the part's own mass is loaded by: free fall, acceleration, angular velocity and acceleration."""
    of_one, of_r = integrals_of_the_solver(part.mesh)
    return part.density * (of_one[:, None] * case.field - np.cross(case.spin, np.cross(case.spin, of_r))) + part.node_forces(case)


def integrals_of_the_solver(mesh):
    """∫ N dV and ∫ N r dV as CalculiX integrates them: over tetrahedra of ten nodes at four points, exact to the second order, where N r is of the third."""
    of_one, of_r = np.zeros(len(mesh.points)), np.zeros((len(mesh.points), 3))
    for block in mesh.blocks:
        if not block.of.is_tetrahedron:
            return mesh.integrals
        N = block.of.shape((1 - 1 / np.sqrt(5)) / 4 + np.vstack([np.zeros(3), np.eye(3)]) / np.sqrt(5))
        x = mesh.points[block.nodes]
        weight = np.linalg.det(x[:, 1:4] - x[:, :1]) / 24  # edges are straight
        np.add.at(of_one, block.nodes, weight[:, None] * N.sum(axis=0))
        np.add.at(of_r, block.nodes, weight[:, None, None] * np.einsum("pn,pm,emi->eni", N, N, x))
    return of_one, of_r


def held_elsewhere(text, part):
    """The same deck with other nodes that hold it: those next to them along the bar."""
    rows = [row for row, _ in part.holding]
    taken = {n for seat in part.seats for n in seat.nodes.tolist()}
    corners = np.setdiff1d(np.unique(np.concatenate([b.nodes[:, : b.of.corners].ravel() for b in part.mesh.blocks])), [*taken, *rows])
    points = part.mesh.points
    other = {row: int(corners[np.argmin(np.linalg.norm(points[corners] - points[row], axis=1))]) for row in rows}
    for row, new in other.items():
        for axis in (1, 2, 3):
            text = text.replace(f"\n{part.mesh.numbers[row]}, {axis}, {axis}\n", f"\n{part.mesh.numbers[new]}, {axis}, {axis}\n")
    return text, [part.mesh.numbers[new] for new in other.values()]


@pytest.mark.parametrize(
    ("kind", "units", "coupling"), [("C3D20R", "m-kg-s", "distributing"), ("C3D20R", "mm-t-s", "rigid"), ("C3D10", "mm-t-s", "distributing")]
)
def test_nothing_holds_a_swinging_bar_and_its_stresses_do_not_depend_on_what_holds_it(tmp_path, kind, units, coupling):
    """Gravity, ω and α, a wrench at the tip and the hinge's: what three nodes hold is round-off, relative to the force of the hinge."""
    cases = bar_cases()
    hinge = np.linalg.norm(cases[0].bodies["bar"].wrenches[0].wrench[:3])
    left, stress, _, _ = solved(tmp_path, cases, kind, units, coupling)
    assert np.abs(left.sum(axis=0)).max() < 1e-9 * hinge, left
    assert np.abs(linear_stress(stress) - middle_of_the_beam(cases[0].bodies["bar"])).max() < 2e-4 * np.abs(stress[:, 3:]).max()
    _, other, _, _ = solved(tmp_path, cases, kind, units, coupling, turned=True)
    assert np.abs(other - stress)[:, 3:].max() < 1e-8 * np.abs(stress[:, 3:]).max(), "whichever nodes hold it"


def linear_stress(stress):
    """The stress along the bar in its middle, by points of integration beside it: of the axis, and what bending adds at an edge in y and in z."""
    x, y, z, along = stress[np.abs(stress[:, 0] - SIZE[0] / 2) < 0.6 * SIZE[0] / COUNTS[0]][:, :4].T
    return np.linalg.lstsq(np.column_stack([np.ones_like(x), 2 * y / SIZE[1], 2 * z / SIZE[2], x - SIZE[0] / 2]), along, rcond=None)[0][:3]


def middle_of_the_beam(body):
    """What a beam has there, by Newton's and Euler's laws of its outer half: N/A, and the bending moments over their moduli."""
    (L, b, h), tip = SIZE, body.wrenches[-1]
    assert tip.name == "tip"
    cut, c, m = np.array([L / 2, 0, 0]), np.array([3 * L / 4, 0, 0]), body.mass / 2
    inertia = m * np.diag([b * b + h * h, L * L / 4 + h * h, L * L / 4 + b * b]) / 12
    spin, turn = body.angular_velocity, body.angular_acceleration
    own = m * (body.gravity_field - body.acceleration - np.cross(turn, c) - np.cross(spin, np.cross(spin, c)))
    force = -(tip.wrench[:3] + own)  # on the outer half
    moment = -(tip.wrench[3:] + np.cross(tip.point - cut, tip.wrench[:3]) + np.cross(c - cut, own) - inertia @ turn - np.cross(spin, inertia @ spin))
    return np.array([-force[0] / (b * h), moment[2] / (h * b * b / 6), -moment[1] / (b * h * h / 6)])


@pytest.mark.parametrize("coupling", ["distributing", "rigid"])
def test_a_cantilever_bends_as_the_formula_says(tmp_path, coupling):
    """A force at the tip, which the hinge balances: between the quarters, where the ends' couplings don't reach, the bar bends as Timoshenko's beam with κ = 5/6, and ν = 0."""
    L, b, h = SIZE
    force = 50.0
    cases = bar_cases(speed=0.0, acceleration=0.0, tip=(0.0, force, 0.0, 0.0, 0.0, 0.0))
    _, _, at, u = solved(tmp_path, cases, "C3D20R", "m-kg-s", coupling)
    I, shear = h * b**3 / 12, 5 / 6 * YOUNG / 2 * b * h
    sections = [np.abs(at[:, 0] - x) < 1e-9 for x in (L / 4, 3 * L / 4)]
    first, last = (u[of].mean(axis=0)[1] for of in sections)
    turn = np.polyfit(at[sections[0], 1], -u[sections[0], 0], 1)[0]
    bend = lambda x: force / (YOUNG * I) * (L * x**2 / 2 - x**3 / 6) + force * x / shear
    formula = bend(3 * L / 4) - bend(L / 4) - force / (YOUNG * I) * (L * L / 4 - L * L / 32) * L / 2
    np.testing.assert_allclose(last - first - turn * L / 2, formula, rtol=1e-3)
