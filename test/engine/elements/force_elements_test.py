"""Springs, dampers and cylinders between two points: how they are stated, closed forms, what becomes of them, motions of others' mechanisms."""

import pickle
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import ksl
from ksl import mjcf

ROBOTS = Path(__file__).parents[3] / "examples/robots"
ON = "force elements"
NUMBERS = {"stiffness": 500.0, "free_length": 0.3, "damping": 40.0, "preload": -25.0}
BESIDE = """
[[force_element]]
name = "strut"
link1 = "wall"
point1 = [0, 0, -0.5]
link2 = "rod"
point2 = [0.4, 0, 0]
stiffness = 500
free_length = 0.3
damping = 40.0
preload = -25
"""


def pendulum(**more) -> ksl.Builder:
    """A rod along x that turns about y: a strut leads from half a metre below the hinge to 0.4 m along the rod."""
    b = ksl.Builder("pendulum").add_link("wall").add_link("rod", mass=2.0, center_of_mass=(0.5, 0, 0), inertia=np.diag([0, 1, 1]) / 6)
    b.add_joint("hinge", "continuous", "wall", "rod", axis=(0, -1, 0))
    return b.add_force_element("strut", "wall", (0, 0, -0.5), "rod", (0.4, 0, 0), **(NUMBERS | more))


def strut(angle, rate):
    """Length, its rate, tension and dl/dq by the law of cosines: the angle at the hinge is 90° + q."""
    length = np.sqrt(0.4**2 + 0.5**2 + 2 * 0.4 * 0.5 * np.sin(angle))
    slope = 0.4 * 0.5 * np.cos(angle) / length
    return length, slope * rate, -25 + 500 * (length - 0.3) + 40 * slope * rate, slope


def test_a_pendulum_on_a_strut_has_closed_forms():
    m = pendulum().build(physics=ON)
    for q, v, a in ((0.3, 0.7, -1.1), (-0.9, 2.0, 0.4)):
        length, rate, tension, slope = strut(q, v)
        found = m.force_element_states([q], [v])
        np.testing.assert_allclose((found.length[0], found.rate[0], found.tension[0]), (length, rate, tension), rtol=1e-13)
        np.testing.assert_allclose(m.inverse_dynamics([q], [v], [a]), [(2 / 3) * a + 9.81 * np.cos(q) + tension * slope], rtol=1e-12)
        np.testing.assert_allclose(m.energy([q], [v])[1], 9.81 * np.sin(q) - 25 * (length - 0.3) + 250 * (length - 0.3) ** 2, rtol=1e-12)
        bent = -0.2 * np.sin(q) / length - slope**2 / length
        still = -25 + 500 * (length - 0.3)
        np.testing.assert_allclose(m.stiffness([q]), [[-9.81 * np.sin(q) + 500 * slope**2 + still * bent]], rtol=1e-11)
        np.testing.assert_allclose(m.inverse_dynamics_derivatives([q], [v], [a])[1], [[40 * slope**2]], rtol=1e-11)


def test_a_zero_length_spring_balances_a_weight_everywhere():
    """Stiffness m g c / (h r) at height h above the hinge and r along the rod: no effort at any position, nor where its points meet."""
    b = pendulum(damping=0.0, stiffness=0.0, preload=0.0)
    for h, r, more in ((0.7, 0.4, {}), (0.4, 0.4, {})):
        b = pendulum(damping=0.0, stiffness=0.0, preload=0.0)
        b.add_force_element("balance", "wall", (0, 0, h), "rod", (r, 0, 0), stiffness=2 * 9.81 * 0.5 / (h * r), **more)
        q = np.linspace(-3, 3, 7)[:, None]
        assert abs(b.build(physics=ON).gravity_torque(q)).max() < 1e-13
        assert abs(b.build(physics=ON).gravity_torque([np.pi / 2])).max() < 1e-13


def test_stops_act_beyond_the_limits_alone():
    m = pendulum(damping=0.0, limits=(0.5, 0.7), stop_stiffness=1e4).build(physics=ON)
    for q in (-0.9, 0.1, 1.0):
        length, _, tension, _ = strut(q, 0.0)
        beyond = min(length - 0.5, 0) + max(length - 0.7, 0)
        np.testing.assert_allclose(m.force_element_states([q]).tension, [tension + 1e4 * beyond], rtol=1e-12)


def test_they_are_off_unless_named_and_say_so():
    m = pendulum().build()
    assert m.unused == ("force element strut (read, not applied)",) and m.with_physics("all").unused == ()
    assert m.gravity_torque([0.3]) == pytest.approx(9.81 * np.cos(0.3)) and m.energy([0.3], [0.0])[1] == pytest.approx(9.81 * np.sin(0.3))
    assert m.force_element_states([0.3]).tension == pytest.approx(strut(0.3, 0.0)[2])


def test_every_way_to_state_them_is_the_same(tmp_path):
    m, beside = pendulum().build(physics=ON), tmp_path / "strut.toml"
    beside.write_text(BESIDE)
    plain = m.to_urdf().split("<force_element")[0] + "</robot>"
    (tmp_path / "robot.urdf").write_text(plain)
    others = [ksl.load(tmp_path / "robot.urdf", loops=beside, physics=ON), ksl.load_string(m.to_urdf(), physics=ON), pickle.loads(pickle.dumps(m))]
    others += [m.with_frame("tip", "rod"), m.with_gravity(m.gravity), m.with_payload("rod", 0.0), m.with_root("wall")]
    for other in others:
        assert other.force_elements == m.force_elements
        assert np.array_equal(other.inverse_dynamics([0.3], [0.7], [0.1]), m.inverse_dynamics([0.3], [0.7], [0.1]))
    turned = m.with_root("rod")
    assert turned.force_elements[0].link1 == "wall" and turned.gravity_torque([0.3]) != turned.with_physics(None).gravity_torque([0.3])
    two = m.merged(m, "rod", prefix="second_")
    assert [(e.name, e.link2) for e in two.force_elements] == [("strut", "rod"), ("second_strut", "second_rod")]
    frozen = m.with_frozen_joints({"hinge": 0.2})
    assert frozen.reactions([], [], [], joints=["hinge"]).any() and frozen.force_elements == m.force_elements
    with pytest.raises(ksl.DescriptionError, match='force element "strut" acts on link wall, which link "rod" doesn\'t carry'):
        m.subtree("rod")
    assert m.subtree("rod", loops="drop").force_elements == ()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"link2": "wall"}, 'both of its points are on link "wall"; name two links'),
        ({"link2": "rodd"}, 'second link "rodd" does not exist; did you mean "rod"'),
        ({"name": "strut"}, "a second one has that name"),
        ({"name": ""}, "a force element has no name"),
        ({"name": "\x07"}, "control character"),
        ({"point1": (0, 0, np.inf)}, "point1 needs three finite numbers"),
        ({"stiffness": -1.0}, "stiffness is -1; expected a number that is not negative"),
        ({"damping": np.nan}, "damping is nan"),
        ({"preload": np.inf}, "preload is inf; expected a number, N"),
        ({"limits": (0.4, 0.2)}, "its lower limit 0.4 is above its upper 0.2"),
        ({"limits": 3.0}, "its limits"),
        ({"stop_stiffness": 1.0}, "it has a stop_stiffness and no limit"),
    ],
)  # fmt: skip
def test_bad_elements_are_refused(given, said):
    whole = {"name": "other", "link1": "wall", "point1": (0, 0, 1), "link2": "rod", "point2": (1, 0, 0)} | given
    with pytest.raises(ValueError, match=said):
        pendulum().add_force_element(**whole)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("stiffness = 500", 'stiffness = "5"', "force element strut: stiffness is '5'; expected a number"),
        ("point1 = [0, 0, -0.5]", "point1 = [0, 0]", r"force element strut: point1 is \[0, 0\]; expected three numbers"),
        ('link1 = "wall"', "", 'force element strut: no link1; write link1 = "..."'),
        ("preload", "preloud", "unknown key 'preloud'; did you mean"),
        ("[[force_element]]", "[force_element]", r"begin each force element with a line \[\[force_element\]\]"),
        ('link2 = "rod"', 'link2 = "wall"', 'force element "strut": both of its points'),
    ],
)
def test_bad_files_are_refused(tmp_path, old, new, said):
    assert old in BESIDE
    (tmp_path / "strut.toml").write_text(BESIDE.replace(old, new))
    (tmp_path / "robot.urdf").write_text(pendulum().build().to_urdf().split("<force_element")[0] + "</robot>")
    with pytest.raises(ksl.DescriptionError, match=f"strut.toml: .*{said}"):
        ksl.load(tmp_path / "robot.urdf", loops=tmp_path / "strut.toml")


def test_where_an_element_has_no_force_it_is_named():
    m = pendulum(limits=(0.2, 0.7)).add_force_element("meets", "wall", (0.1, 0, 0), "rod", (0.1, 0, 0), preload=1.0).build(physics=ON)
    for q, said in (
        (0.0, '"meets": its points on links wall and rod coincide'),
        (1.2, '"strut": its length is .* m, above its upper limit of 0.7'),
        (-1.4, '"strut": its length is .* m, below its lower limit of 0.2'),
    ):
        for call in (m.gravity_torque, m.stiffness, m.force_element_states, lambda q: m.energy(q, [0.0]), lambda q: m.forward_dynamics(q, [0.0], [0.0])):
            with pytest.raises(ksl.ResultError, match=said):
                call([q])
        with pytest.raises(ksl.ResultError, match=f"state 3: .*{said}"):
            m.gravity_torque([[0.1], [0.1], [0.1], [q], [0.1]])
    with pytest.raises(ValueError, match="second_derivatives is not available with force elements"):
        m.inverse_dynamics_second_derivatives([0.3], [0.0], [0.0])
    with pytest.warns(RuntimeWarning, match="force element strut has no force there: it is beyond a limit without a stop, or "):
        m.simulate([0.1], [20.0], [0, 5.0])


@pytest.mark.parametrize("how", [{}, *({"method": name, "step": 1e-3} for name in ("semi_implicit_euler", "rk4", "rkmk4", "sdirk4", "variational"))], ids=str)
@pytest.mark.parametrize("events", [[], [lambda t, q, v: 1.0]], ids=["alone", "events"])
def test_runs_that_end_where_points_coincide_name_the_element(how, events):
    """From the start, and in a run that gets there; one run, and several."""
    m = pendulum().add_force_element("meets", "wall", (0.1, 0, 0), "rod", (0.1, 0, 0), preload=1.0).build(physics=["force elements"])
    for q in ([0.0], [[0.4], [0.0], [0.5]]):
        with pytest.warns(RuntimeWarning, match="force element meets has no force there: its points on links wall and rod coincide"):
            run = m.simulate(q, np.zeros_like(q), [0, 0.02], events=events, **how)
        assert list(np.ravel(run.complete)) == [np.any(x) for x in np.atleast_2d(q)]


TENDONS = """<mujoco><worldbody><site name="a" pos=".3 .1 .2"/><body><joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".03"/>
<site name="c" pos=".1 0 -.3"/><body pos="0 0 -.5"><joint type="ball"/><geom type="capsule" fromto="0 0 0 .3 0 -.1" size=".02"/><site name="b" pos=".2 .05 -.1"/></body></body>
</worldbody><tendon><spatial name="s" stiffness="100" damping="7" springlength=".3"><site site="a"/><site site="b"/></spatial>
<spatial stiffness="200" springlength=".1 .2"><site site="c"/><site site="b"/></spatial><spatial stiffness="3"><site site="c"/><site site="a"/><site site="b"/></spatial>
</tendon></mujoco>"""


def test_tendons_of_mujoco_between_two_sites():
    m, mj = ksl.load_string(TENDONS, physics=ON), mujoco.MjModel.from_xml_string(TENDONS)
    assert [(e.name, e.link1, e.link2) for e in m.force_elements] == [("s", "world", "body2"), ("tendon1", "body1", "body2")]
    assert "tendon (1)" in m.unused  # the one over three sites
    mj.tendon_stiffness[2], data = 0, mujoco.MjData(mj)
    rng = np.random.default_rng(0)
    for _ in range(5):
        q, v = m.random(rng), rng.normal(size=m.nv)
        found = mjcf.to_mujoco(m, q, v, m.forward_dynamics(q, v, np.zeros(m.nv)))
        data.qpos[:], data.qvel[:] = found.q, found.v
        mujoco.mj_forward(mj, data)
        np.testing.assert_allclose(found.a, data.qacc, rtol=1e-11, atol=1e-11 * abs(data.qacc).max())
        np.testing.assert_allclose(m.force_element_states(q, v).length, data.ten_length[:2], rtol=1e-12)


def test_energy_of_a_run_is_accounted_for():
    m = pendulum().build(physics=ON)
    run = m.simulate([0.3], [2.0], [0, 0.5, 1.0], rtol=1e-11, atol=1e-11)
    heat = solve_ivp(lambda t, y: pendulum_rates(y), (0, 1), [0.3, 2.0, 0.0], rtol=1e-12, atol=1e-12).y[:, -1]
    np.testing.assert_allclose((run.q[-1, 0], run.v[-1, 0]), heat[:2], atol=1e-9)
    assert abs(run.drift.energy).max() < 1e-8 and run.work[-1] == pytest.approx(-heat[2], rel=1e-8)
    for method, tolerance in (("rk4", 1e-6), ("sdirk4", 1e-6), ("variational", 1e-3)):
        other = m.simulate([0.3], [2.0], [0, 0.5, 1.0], method=method, step=1e-3)
        np.testing.assert_allclose(other.q, run.q, atol=tolerance)
        assert abs(other.drift.energy).max() < 10 * tolerance


def pendulum_rates(y):
    _, rate, tension, slope = strut(y[0], y[1])
    return [y[1], -1.5 * (9.81 * np.cos(y[0]) + tension * slope), 40 * rate**2]


def test_andrews_squeezing_mechanism():
    """The reference solution at 0.03 s of the Test Set for Initial Value Problem Solvers (Mazzia and Magherini, University of Bari)."""
    m = ksl.load(ROBOTS / "andrews.urdf", physics=ON, gravity=(0, 0, 0))
    names = ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")
    start = (-0.06171389001427642, 0.0, 0.4552798191630704, 0.2226683901658859, 0.48736497954384255, -0.2226683901658859, 1.2305474445498212)
    end = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304, 0.5347301163226948, 1.048080741042263)
    rates = (1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808, -19.29337464421385, 0.3231791658026955)
    order = [names.index(name) for name in m.joint_names]
    tau = np.where(np.array(m.joint_names) == "beta", 0.033, 0.0)
    assert m.mobility(np.array(start)[order]).mobility == 1
    run = m.simulate(np.array(start)[order], np.zeros(7), np.linspace(0, 0.03, 16), efforts=tau, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(run.q[-1], np.array(end)[order], atol=5e-9)
    np.testing.assert_allclose(run.v[-1], np.array(rates)[order], rtol=1e-7)
    assert run.drift.closure.max() < 1e-13 and abs(run.drift.energy).max() < 1e-11
    # derivatives along the mechanism, with the spring, are those of differences of efforts
    q, v = run.q[7], run.v[7]
    a = m.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(m.inverse_dynamics(q, v, a), tau, atol=1e-9)
    by_q, by_v, _ = m.forward_dynamics_derivatives(q, v, tau)
    (crank,), drives = m.independent(q), ["beta"]
    for analytic, of_q in ((by_q, 1), (by_v, 0)):
        ends = []
        for step in (1e-6, -1e-6):
            at = m.close(m.integrate(q, of_q * step * m.consistent_velocity(q, np.eye(7)[crank], given=drives)), hold=drives).q
            moving = v + (1 - of_q) * step * 1e3 * np.eye(7)[crank]
            ends.append(m.forward_dynamics(at, m.consistent_velocity(at, moving, given=drives), tau))
        found = (ends[0] - ends[1]) / 2e-6 / (1 if of_q else 1e3)
        np.testing.assert_allclose(analytic[:, 0], found, rtol=2e-5, atol=2e-5 * abs(found).max())


def governor_rates(y, momentum):
    """A governor in three coordinates: the angle of its rods, the way of its slider, and the turn of its shaft, whose momentum stays."""
    angle, way, _, rate, speed = y
    s, c = np.sin(angle), np.cos(angle)
    length = np.hypot(0.5 * s, way - 0.5 * c)
    by_angle, by_way = 0.5 * way * s / length, (way - 0.5 * c) / length
    force = 8e5 * (length - 0.5) + 4e4 * (by_angle * rate + by_way * speed)
    turn = momentum / (0.15 + 12 * s**2)
    return [rate, speed, turn, s * c * turn**2 - 6.5 / 6 * 9.81 * s - force * by_angle / 6, 9.81 - force * by_way / 10]


def test_a_stiff_governor():
    """After problem A05 of the IFToMM benchmarks; against Radau's method on equations of its own."""
    m = ksl.load(ROBOTS / "governor.urdf", physics=ON)
    start = dict(zip(("turn", "to_left", "to_right", "slide"), (0.0, np.pi / 6, np.pi / 6, 0.5 * np.sqrt(3)), strict=True))
    q, v = np.array([start[name] for name in m.joint_names]), np.where(np.array(m.joint_names) == "turn", 2 * np.pi, 0.0)
    times = [0, 0.5, 1.0]
    y = [start["to_left"], start["slide"], 0, 0, 0]
    exact = solve_ivp(lambda t, y: governor_rates(y, 3.15 * 2 * np.pi), (0, 1), y, "Radau", times, rtol=1e-11, atol=1e-12).y
    expected = np.array([{"turn": e[2], "to_left": e[0], "to_right": e[0], "slide": e[1]}[name] for e in exact.T for name in m.joint_names]).reshape(3, 4)
    for options, tolerance in (({"rtol": 1e-9, "atol": 1e-9}, 1e-7), ({"method": "sdirk4", "step": 2e-3}, 1e-6)):
        run = m.simulate(q, v, times, **options)
        np.testing.assert_allclose(run.q, expected, atol=tolerance)
        assert abs(run.drift.energy).max() < 1e-2


def test_a_stiff_damper_in_a_closed_mechanism():
    """Andrews's mechanism with a damper of 2000 N s/m beside its spring: the implicit method takes steps that others can't."""
    text = (ROBOTS / "andrews.urdf").read_text().replace('free_length="0.07785"', 'free_length="0.07785" damping="2000"')
    m = ksl.load_string(text, physics=ON, gravity=(0, 0, 0))
    q = m.close(m.neutral(), hold=["beta"]).q
    tau = np.where(np.array(m.joint_names) == "beta", 0.033, 0.0)
    exact = m.simulate(q, np.zeros(7), [0, 0.01], efforts=tau, rtol=1e-10, atol=1e-10)
    coarse, fine = (m.simulate(q, np.zeros(7), [0, 0.01], efforts=tau, method="sdirk4", step=h) for h in (1e-3, 5e-4))
    for run, tolerance in ((coarse, 1e-5), (fine, 1e-6)):
        np.testing.assert_allclose(run.q[-1], exact.q[-1], atol=tolerance)
        assert run.drift.closure.max() < 1e-6
