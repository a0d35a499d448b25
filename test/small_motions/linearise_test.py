"""Linear models against differences of the motion itself, simulations, scipy.signal and the package control."""

import numpy as np
import pytest

import ksl
from ksl.mechanism.joint_kinds import columns_of
from linkages import FOURBAR, FREE_COUPLER, SLIDERCRANK, at

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


class Motion:
    """A state x = (q ⊖ q₀, v − v₀) of independent coordinates, its rate, and outputs, by the calls of the model; loops are closed."""

    def __init__(self, m, q, v, tau, outputs):
        self.m, self.q, self.v, self.tau, self.outputs = m, q, v, tau, outputs
        self.own = m.independent(q) if m.loops else np.arange(m.nv)

    def state(self, x):
        n = len(self.own)
        if not self.m.loops:
            return self.m.integrate(self.q, x[:n]), self.v + x[n:]
        q = self.q
        for _ in range(8):
            left, rates = np.zeros(self.m.nv), np.zeros(self.m.nv)
            left[self.own] = x[:n] - self.m.difference(self.q, q)[self.own]
            q = self.m.close(self.m.integrate(q, self.m.consistent_velocity(q, left, self.own)), starts=1).q
        rates[self.own] = self.v[self.own] + x[n:]
        return q, self.m.consistent_velocity(q, rates, self.own)

    def __call__(self, x):
        q, v = self.state(x)
        a = self.m.forward_dynamics(q, v, self.tau)
        rate = self.m.difference_jacobians(self.q, q)[1] @ v
        return np.concatenate([rate[self.own], a[self.own], [self.output(name, q, v, a) for name in self.outputs]])

    def output(self, name, q, v, a):
        joint, _, end = name.rpartition(".")
        if end in WRENCH:
            return self.m.reactions(q, v, a, joints=[joint])[0, WRENCH.index(end)]
        of = self.m.joint(joint or name)
        role, column = next((role, columns.index(name)) for role, columns in enumerate(columns_of(of)) if name in columns)
        return self.m.position_of(of, q) if role == 0 else (v, a)[role - 1][of.v_index + column]

    def derivative(self, h=2e-4):
        each = np.eye(2 * len(self.own))
        return np.array([(8 * (self(h * e) - self(-h * e)) - self(2 * h * e) + self(-2 * h * e)) / (12 * h) for e in each]).T


def tree():
    b = ksl.Builder("tree").add_link("base", 2.0, (0.1, 0.02, 0.03), np.diag([0.1, 0.2, 0.15]))
    rng, parent = np.random.default_rng(0), "base"
    for k, (kind, axes) in enumerate(
        {"spherical": {}, "revolute": {"axis": (0.6, 0, 0.8)}, "universal": {"axis": (1, 0, 0), "axis2": (0, 1, 0)}, "planar": {"axis": (0, 0, 1)}}.items()
    ):
        b.add_link(f"l{k}", 1 + 0.2 * k, rng.normal(size=3) * 0.2, np.diag([0.02, 0.03, 0.025]))
        b.add_joint(f"j{k}", kind, parent, f"l{k}", xyz=rng.normal(size=3) * 0.3, rpy=rng.normal(size=3), damping=0.1, **axes)
        parent = f"l{k}"
    m = b.build(floating_base=True, physics="damping")
    return m, m.random(1), rng.normal(size=m.nv), rng.normal(size=m.nv)


def closed(text):
    m = ksl.load_string(text, drives=["A"])
    start = m.close(m.neutral()).q
    q = m.close(m.integrate(start, m.consistent_velocity(start, 0.3 * np.eye(m.nv)[0], ["A"])), hold=["A"]).q
    return m, q, m.consistent_velocity(q, 2.5 * np.eye(m.nv)[0], ["A"]), 1.3 * np.eye(m.nv)[0]


def hung():
    """A body that floats, held at a ball by a link of a chain: four freedoms, so that turns don't commute."""
    b = ksl.Builder("hung").add_link("ground").add_link("arm", 1.0, (0.1, 0.05, 0), np.diag([0.02, 0.03, 0.025]))
    b.add_joint("A", "revolute", "ground", "arm", xyz=(0.1, 0, 0.2), axis=(0.6, 0, 0.8))
    b.add_link("body", 2.0, (0.1, 0.2, -0.1), np.diag([0.05, 0.03, 0.04])).add_joint("free", "floating", "ground", "body", xyz=(0, 0.1, 0), rpy=(0.3, 0.2, 0.1))
    m = b.add_loop("ball", "spherical", "arm", "body", at([0.3, 0.1, 0]), at([0, 0.1, 0.2])).build(drives=["A"])
    q = m.close(m.random(1)).q
    own = m.independent(q)
    return m, q, m.consistent_velocity(q, np.where(np.isin(np.arange(m.nv), own), np.linspace(-1.5, 2, m.nv), 0), own), 1.3 * np.eye(m.nv)[0]


@pytest.mark.parametrize(
    "state, outputs",
    [
        (hung(), ["A.a", "free.wx", "free.vy", "free.az"]),
        (tree(), ["j1", "j1.v", "j1.a", "j0.wx", "j0.bx", "j2.fx", "j0.ty", "floating_base.wz", "floating_base.az"]),
        (closed(FOURBAR), ["A", "B", "B.v", "B.a", "C.fx", "B.fz"]),
        (closed(FREE_COUPLER), ["A.a", "C.fx", "D.v", "D", "B.wx", "B.vx", "B.vz"]),
        (closed(SLIDERCRANK), ["S", "S.v", "S.a", "C.fz"]),
    ],
    ids=["body on a ball", "tree", "four-bar", "four-bar with a coupler that floats", "slider-crank"],
)
def test_about_a_moving_state_it_is_the_derivative_of_the_motion(state, outputs):
    m, q, v, tau = state
    l = m.linearise(q, v, tau, outputs=outputs)
    motion = Motion(m, q, v, tau, outputs)
    found, wanted = np.vstack([l.A, l.C]), motion.derivative()
    np.testing.assert_allclose(found, wanted, atol=1e-8 * np.abs(wanted).max())
    n = len(l.rate)
    np.testing.assert_allclose(np.concatenate([l.rate, l.output]), motion(np.zeros(n)), atol=1e-10 * np.abs(wanted).max())
    assert not l.equilibrium and l.outputs == tuple(outputs)
    for k, name in enumerate(l.inputs):  # accelerations and reactions are linear in efforts
        push = np.zeros(m.nv)
        push[[c for joint in m.joints if joint.nv for c in ([joint.name] if joint.nv == 1 else columns_of(joint)[1])].index(name)] = 1.0
        pushed = Motion(m, q, v, tau + push, outputs)(np.zeros(n)) - motion(np.zeros(n))
        np.testing.assert_allclose(np.concatenate([l.B[:, k], l.D[:, k]]), pushed, atol=1e-9 * np.abs(np.vstack([l.B, l.D])).max())


def cart(**options):
    b = ksl.Builder("cart").add_link("ground").add_link("cart", 2.0, (0, 0, 0), np.eye(3) * 0.1).add_link("pole", 0.5, (0, 0, -0.4), np.eye(3) * 0.01)
    b.add_joint("slide", "prismatic", "ground", "cart", axis=(1, 0, 0), damping=2.0)
    return b.add_joint("hinge", "continuous", "cart", "pole", axis=(0, 1, 0), damping=0.02).build(physics="damping", **options)


def test_simulations_about_an_equilibrium_stay_with_it():
    """Continuous by scipy.signal, and step by step by the zero-order hold."""
    from scipy.signal import dlsim, lsim

    m, small = cart(), 1e-4
    l = m.linearise([0, 0], inputs=["slide"], outputs=["slide", "hinge", "hinge.v"])
    assert l.equilibrium and l.inputs == ("slide",) and l.states == ("slide", "hinge", "d/dt slide", "d/dt hinge")
    t = np.linspace(0, 2, 101)
    run = m.simulate(np.array([0, small]), np.zeros(2), t, efforts=np.array([small, 0.0]), rtol=1e-12, atol=1e-16)
    x0, u = np.array([0, small, 0, 0]), np.full((len(t), 1), small)
    y = lsim(l.state_space(), u, t, X0=x0)[1]
    wanted = np.column_stack([run.q, run.v[:, 1]])
    np.testing.assert_allclose(y, wanted, atol=small * small)
    step = l.discrete(t[1])
    np.testing.assert_allclose(dlsim(step.state_space(), u, x0=x0)[1], y, atol=1e-11)
    np.testing.assert_allclose([*step][2], l.C)
    assert len(step) == 4 and step.dt == t[1] and "dt=0.02 s" in repr(step)


def test_about_a_moving_state_the_discrete_model_has_the_way_of_the_state_itself():
    m, h = cart(), 1e-3
    q, v, tau = np.array([0.1, 1.0]), np.array([0.5, -2.0]), np.array([1.0, 0.3])
    run = m.simulate(q, v, [0.0, h], efforts=tau, rtol=1e-12, atol=1e-14)
    moved = np.concatenate([run.q[-1] - q, run.v[-1] - v])
    np.testing.assert_allclose(m.linearise(q, v, tau).discrete(h).rate, moved, atol=2e-8)  # the second order is left out: h³
    assert np.abs(moved).max() > 1e-3


def test_the_package_control_takes_it_with_its_names():
    control = pytest.importorskip("control")
    l = cart().linearise([0, np.pi], inputs=["slide"])
    system = l.control()
    assert system.state_labels == ["slide", "hinge", "d_slide", "d_hinge"] and system.input_labels == ["slide"]
    gain = control.lqr(system, np.eye(4), np.eye(1))[0]
    assert np.linalg.eigvals(l.A).real.max() > 1 and np.linalg.eigvals(l.A - l.B @ gain).real.max() < 0
    assert l.discrete(0.01).control().dt == 0.01


def test_a_joint_with_several_coordinates_has_several_inputs():
    m, q, v, tau = tree()
    found, all_ = m.linearise(q, v, tau, inputs=["j1", "j0"]), m.linearise(q, v, tau)
    names = columns_of(m.joint("j0"))[1]
    assert found.inputs == ("j1", *names)
    np.testing.assert_array_equal(found.B, all_.B[:, [all_.inputs.index(name) for name in found.inputs]])


def test_bad_input():
    m, q, v, tau = closed(FOURBAR)
    with pytest.raises(ValueError, match="loop joint C: these velocities open it by"):
        m.linearise(q, np.ones(3), tau)
    with pytest.raises(ValueError, match="outputs: B.fy is not determined by rigid bodies"):
        m.linearise(q, v, tau, outputs=["B.fy"])
    with pytest.raises(ValueError, match="outputs: 'crnk' is no column; .*columns are JOINT, JOINT.v"):
        m.linearise(q, outputs=["crnk"])
    with pytest.raises(ValueError, match="no joint named 'C' has coordinates; it closes a loop"):
        m.linearise(q, inputs=["C"])
    with pytest.raises(ValueError, match="name a coordinate twice"):
        m.linearise(q, inputs=["A", "A"])
    with pytest.raises(ValueError, match="tau has shape"):
        m.linearise(q, tau=[1.0, 2.0])
    with pytest.raises(ValueError, match="names no drives; say which joints have motors"):
        ksl.load_string(FOURBAR).linearise(q)
    with pytest.raises(ValueError, match="dt=-1; expected a step in s, above 0"):
        m.linearise(q).discrete(-1)
    with pytest.raises(ValueError, match="the model is discrete"):
        m.linearise(q).discrete(0.1).discrete(0.1)


ARM = """<mujoco><compiler angle="radian"/><worldbody><body pos="0 0 1"><joint name="j0" axis="0 1 0" damping="0.3"/><inertial pos="0.2 0.05 0" mass="3" diaginertia="0.02 0.05 0.05"/>
<body pos="0.5 0 0" euler="0.3 0 0.2"><joint name="j1" type="slide" axis="1 0 0" damping="4" stiffness="200" springref="0.1"/><inertial pos="0.1 0 0.03" mass="2" diaginertia="0.01 0.03 0.03"/>
<body pos="0.3 0 0"><joint name="j2" axis="0.6 0 0.8" armature="0.02"/><inertial pos="0.1 0.1 0" mass="1" diaginertia="0.01 0.01 0.02"/></body></body></body></worldbody></mujoco>"""


def test_the_same_arm_in_mujoco(tmp_path):
    """Central differences of its accelerations, about a moving state."""
    mujoco = pytest.importorskip("mujoco")
    (tmp_path / "arm.xml").write_text(ARM)
    m = ksl.load(tmp_path / "arm.xml", physics=["damping", "spring", "armature"])
    other = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(other)
    state = np.array([0.4, 0.05, -0.7, 0.6, -0.3, 1.1, 2.0, -5.0, 0.4])

    def accelerations(x):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = np.split(x, 3)
        mujoco.mj_forward(other, data)
        return data.qacc.copy()

    l = m.linearise(*np.split(state, 3))
    differences = np.array([(accelerations(state + h) - accelerations(state - h)) / 2e-4 for h in 1e-4 * np.eye(9)]).T
    np.testing.assert_allclose(l.rate[3:], accelerations(state), rtol=1e-10)
    np.testing.assert_allclose(np.hstack([l.A[3:], l.B[3:]]), differences, atol=1e-7 * np.abs(differences).max())
