"""Centre of mass and centroidal momentum against the witness: sums over links in world coordinates, and the laws of motion."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import ksl
from newton_euler import apply, coadjoint, inertia_matrix, transpose
from random_tree import Case, load_text


def moving_links(case: Case, floating: bool) -> list[str]:
    """Links that are not welded to the ground."""
    welded = set() if floating else {case.tree.root}
    for joint in case.tree.joints:
        if joint.parent in welded and joint.kind == "fixed":
            welded.add(joint.child)
    return [name for name in case.tree.links if name not in welded]


class Sums:
    """Mass, first moment, momentum and its rate about the world's origin, and the sums of norms that errors are measured by."""

    def __init__(self, case: Case, floating: bool) -> None:
        w, n = case.witness, len(case.q)
        self.mass, self.moment, self.momentum, self.rate = 0.0, np.zeros((n, 3)), np.zeros((n, 6)), np.zeros((n, 6))
        self.external = np.zeros((n, 6))
        for name in moving_links(case, floating):
            link, X = case.tree.links[name], coadjoint(w.pose[name])
            self.mass += link.mass
            self.moment = self.moment + link.mass * apply(w.pose[name], np.append(link.centroid, 1.0))[..., :3]
            self.momentum = self.momentum + apply(X @ inertia_matrix(link) @ transpose(X), w.twist[name])
            self.rate = self.rate + w.momentum_rate[name]
            self.external = self.external + w.external[name]
        self.center = self.moment / self.mass if self.mass else self.moment * np.nan

    def about_center(self, x: np.ndarray) -> np.ndarray:
        """Angular first about the world's origin, as linear first about the centre of mass."""
        c = np.nan_to_num(self.center)
        return np.concatenate([x[:, 3:], x[:, :3] - np.cross(c, x[:, 3:])], axis=1)


def close(found, expected, limit: float = 1e-12) -> None:
    scale = max(1.0, float(np.abs(expected).max(initial=0.0)))
    assert np.abs(found - expected).max(initial=0.0) < limit * scale * 10, np.abs(found - expected).max() / scale


@given(st.integers(0, 2**32 - 1), st.integers(2, 30), st.booleans())
def test_sums_over_links(seed, bodies, floating):
    case = Case(seed, bodies, floating_base=floating)
    m, (q, v, a), s = case.m, case.state, Sums(case, floating)
    if s.mass == 0:
        assert np.isnan(m.center_of_mass(q)).all() and (m.centroidal_momentum(q, v) == 0).all()
        return
    close(m.center_of_mass(q), s.center)
    close(m.center_of_mass_velocity(q, v), s.momentum[:, 3:] / s.mass)
    close(m.center_of_mass_acceleration(q, v, a), s.rate[:, 3:] / s.mass)
    close(m.centroidal_momentum(q, v), s.about_center(s.momentum))
    close(m.centroidal_momentum_rate(q, v, a), s.about_center(s.rate))
    close(apply(m.center_of_mass_jacobian(q), v), s.momentum[:, 3:] / s.mass)
    close(apply(m.centroidal_momentum_matrix(q), v), s.about_center(s.momentum))
    close(m.centroidal_momentum_matrix(q)[:, :3], s.mass * m.center_of_mass_jacobian(q))


@given(st.integers(0, 2**32 - 1), st.integers(2, 20))
def test_momentum_changes_by_what_acts_from_outside(seed, bodies):
    """Gravity at the centre of mass, external wrenches, and what the ground exerts on the joints that it carries."""
    case = Case(seed, bodies)
    m, s = case.m, Sums(case, False)
    if s.mass == 0:
        return
    moving = moving_links(case, False)
    carried = [j.child for j in case.tree.joints if j.parent not in moving and j.child in moving]
    ground = sum((case.witness.wrench[name] for name in carried), np.zeros((len(case.q), 6)))
    weight = np.concatenate([s.mass * m.gravity, np.zeros(3)])
    expected = s.about_center(s.external + ground) + weight
    close(m.centroidal_momentum_rate(*case.state), expected, 1e-12 * max(1.0, case.load))


def test_far_from_the_worlds_origin(examples):
    """A robot that floats a thousand kilometres away has the momenta of one at the origin."""
    m = ksl.load(examples / "robots/panda.urdf", floating_base=True)
    rng = np.random.default_rng(3)
    q, v, a = rng.normal(size=(5, m.nq)), rng.normal(size=(5, m.nv)), rng.normal(size=(5, m.nv))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    far = q.copy()
    far[:, :3] += 1e6
    q[:, :3] = far[:, :3] - 1e6
    assert np.array_equal(m.centroidal_momentum_matrix(far), m.centroidal_momentum_matrix(q))
    assert np.array_equal(m.centroidal_momentum(far, v), m.centroidal_momentum(q, v))
    assert np.array_equal(m.centroidal_momentum_rate(far, v, a), m.centroidal_momentum_rate(q, v, a))


def test_a_rigid_robot(examples):
    """Nothing moves: no centre of mass, and no momentum."""
    m = load_text(
        '<robot name="r"><link name="a"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    q = np.zeros(0)
    assert np.isnan(m.center_of_mass(q)).all() and np.isnan(m.center_of_mass_velocity(q, q)).all()
    assert np.array_equal(m.centroidal_momentum(q, q), np.zeros(6)) and np.array_equal(m.centroidal_momentum_rate(q, q, q), np.zeros(6))
    assert m.center_of_mass_jacobian(q).shape == (3, 0) and m.centroidal_momentum_matrix(q).shape == (6, 0)
