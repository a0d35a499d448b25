"""Arguments of simulate: what is refused, and how runs end that can't go on."""

import re
import threading
import warnings

import numpy as np
import pytest

import ksl
from ksl.simulation import PD, Brake, ComputedTorque, Reference
from linkages import equal_four_bars, four_bar


def arm(**options):
    b = ksl.Builder("arm").add_link("base")
    for name, parent in (("upper", "base"), ("lower", "upper")):
        pose = np.eye(4)
        pose[2, 3] = -0.4 * (parent != "base")
        b.add_link(name, mass=2.0, center_of_mass=(0, 0, -0.2), inertia=np.diag([0.03, 0.03, 0.004]))
        b.add_joint(f"to_{name}", "revolute", parent, name, pose=pose, axis=(0, 1, 0), limits=(-2.0, 2.0), **options)
    return b.build()


M = arm()
START = ([0.8, 0.2], [0.0, 0.0], [0.0, 0.1, 0.2])
REFUSED = {
    "q of another length": (([0.1], *START[1:]), {}, "q has shape (1,); expected (…, 2)"),
    "times that don't increase": ((*START[:2], [0.0, 0.2, 0.2]), {}, "times[2] is 0.2 after 0.2; times must increase"),
    "a time alone": ((*START[:2], 2.0), {}, "times has shape (); expected (n), the first that of the start"),
    "times of a reference alone": (START, {"efforts": ComputedTorque(Reference(1.0, np.zeros((1, 2))))}, "reference.times must be finite and increase"),
    "times that go back": ((*START[:2], [1.0, 0.5]), {}, "times[1] is 0.5 after 1; times must increase"),
    "times that are not finite": ((*START[:2], [0.0, np.inf]), {}, "times must be finite"),
    "times in rows": ((*START[:2], [[0.0, 1.0]]), {}, "times has shape (1, 2); expected (n), the first that of the start"),
    "no times": ((*START[:2], []), {}, "times has shape (0,); expected (n), the first that of the start"),
    "efforts of another length": (START, {"efforts": [[1.0, 2.0]] * 2}, "efforts has shape (2, 2); expected (2,) constant, or (3, 2) at the times"),
    "efforts that are not finite": (START, {"efforts": [np.nan, 0]}, "efforts holds numbers that are not finite"),
    "an unknown method": (START, {"method": "rk5"}, "expected one of semi_implicit_euler, rk4"),
    "no step": (START, {"method": "rk4"}, "the method rk4 has steps of the same length; give step, s"),
    "a step of dop853": (START, {"step": 0.01}, "dop853 chooses its own, by rtol and atol"),
    "a negative tolerance": (START, {"rtol": -1}, "rtol is -1; expected a finite number that is not negative"),
    "the least negative tolerance": (START, {"atol": -1e-300}, "atol is -1e-300; expected a finite number that is not negative"),
    "a tolerance without end": (START, {"rtol": np.inf}, "rtol is inf; expected a finite number that is not negative"),
    "a tolerance that is none": (START, {"rtol": np.nan}, "rtol is nan; expected a finite number that is not negative"),
    "a step of zero": (START, {"method": "rk4", "step": 0.0}, "step is 0; expected a finite number above zero"),
    "no tolerance": (START, {"rtol": 0, "atol": 0}, "dop853 needs a relative or an absolute error above zero"),
    "limits with the variational method": (START, {"method": "variational", "step": 0.01, "restitution": 0.5}, "take another method, or leave them out"),
    "an unknown joint": (START, {"friction": {"to_uper": 1.0}}, "to_uper"),
    "negative friction": (START, {"friction": -1.0}, "friction is -1; expected a finite number, 0 or more"),
    "a restitution that adds energy": (START, {"restitution": {"to_lower": 1.5}}, "restitution of 'to_lower' is 1.5; expected a number from 0 to 1"),
    "a restitution without a limit": (START, {"restitution": -1.0}, "restitution is -1; expected a number from 0 to 1"),
    "a brake that holds anything": (START, {"brake": Brake(np.inf, 0.1)}, "brake is inf; expected a finite number, 0 or more"),
    "a brake that never engages": (START, {"brake": Brake(3.0, np.inf)}, "brake.at is inf; expected a finite number"),
    "gains that are no numbers": (START, {"efforts": PD([0.0, 0.0], np.nan, 1.0)}, "stiffness is nan; expected a finite number"),
    "starts of several lengths": (([[0.8, 0.2]] * 2, [[0, 0]] * 3, START[2]), {}, "leading shapes don't broadcast: q (2, 2), v (3, 2)"),
    "progress that is no function": (START, {"progress": 3}, "progress: int is no function of the time"),
    "an event of two numbers": (START, {"events": lambda t, q, v: [1, 2]}, "the result of events[0] is [1, 2]; expected a number"),
    "a start beyond limits": (([2.5, 0], *START[1:]), {"restitution": 0.5}, "q: 'to_upper' starts at 2.5, beyond its limits -2 and 2"),
    "a brake that is a number": (START, {"brake": 3.0}, "brake is float; expected a ksl.simulation.Brake"),
    "an event that is no function": (START, {"events": [3]}, "events: int is no function of (t, q, v)"),
    "a reference of another length": (START, {"efforts": PD([0.1], 1.0, 1.0)}, "reference has shape (1,); expected a position (2,)"),
    "a reference without order": (START, {"efforts": ComputedTorque(Reference([0, 1, 1], np.zeros((3, 2))))}, "reference.times must be finite and increase"),
    "efforts of functions": (START, {"efforts": lambda t, q, v: [1.0]}, "efforts returned shape (1,) at t = 0 s; expected (2,)"),
    "NaN at the beginning": (START, {"efforts": lambda t, q, v: [np.nan, 0]}, "efforts returned nan at t = 0 s, where the run begins"),
    "NaN of an event": (START, {"events": lambda t, q, v: np.inf if t > 0.05 else 1.0}, re.compile(r"events\[0\] is inf at t = 0\.0\d+ s of run 0")),
    "an unknown link": (START, {"external": {"uppr": [0] * 6}}, "uppr"),
    "wrenches of another length": (START, {"external": {"upper": [0] * 5}}, "external['upper'] has shape (5,); expected (6,) constant, or (3, 6)"),
    "NaN of the second event": (START, {"events": [lambda t, q, v: 1.0, lambda t, q, v: v[1] * np.nan]}, "events[1] is nan at t = 0 s of run 0"),
    **{f"{wrong!r} steps": (START, {"most_steps": wrong}, f"most_steps={wrong!r}; expected a number of steps, 1 or more") for wrong in (0, -1, True, 2.0, "3")},
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case):
    positional, named, said = REFUSED[case]
    with pytest.raises(ValueError, match=said if isinstance(said, re.Pattern) else re.escape(said)):
        M.simulate(*positional, **named)


def test_functions_that_raise_end_the_call():
    def fails(t, q, v):
        raise KeyError("of mine")

    for named in ({"efforts": fails}, {"events": fails}):
        with pytest.raises(KeyError, match="of mine"):
            M.simulate(*START, **named)
    with pytest.raises(KeyError, match="of mine"):
        M.simulate([START[0]] * 3, *START[1:], efforts=fails, method="rk4", step=0.01)
    callers = set()
    called = lambda t, q, v: callers.add(threading.get_ident()) or 1.0
    for named in ({"efforts": lambda t, q, v: [called(t, q, v), 0.0]}, {"events": called}):  # also of many runs by one thread
        M.simulate([START[0]] * 9, *START[1:], threads=2, **named)
    assert callers == {threading.get_ident()}


@pytest.mark.parametrize("how", [{}, *({"method": name, "step": 0.01} for name in ("semi_implicit_euler", "rk4", "rkmk4", "sdirk4", "variational"))], ids=str)
@pytest.mark.parametrize("events", [[], [lambda t, q, v: 1.0]], ids=["alone", "events"])
@pytest.mark.filterwarnings("error")
def test_a_function_that_ends_a_run_at_its_start_leaves_the_state(how, events):
    """What would have driven it is not known."""
    for run in (
        M.simulate(*START, efforts=lambda t, q, v: None, events=events, **how),
        M.simulate([START[0]] * 2, [START[1]] * 2, START[2], efforts=lambda t, q, v: None, events=events, **how),
    ):
        first = run.q.reshape(-1, 3, 2)[-1]
        assert np.all(run.reason == "a function ended it") and np.all(run.ended == 0) and np.array_equal(first[0], START[0]) and np.isnan(first[1:]).all()
        assert np.all(run.work.ravel()[0] == 0) and np.isfinite(run.energy.ravel()[0]) and np.isnan(run.a).all() and np.isnan(run.efforts).all()
    assert np.isnan(M.simulate(*START, efforts=lambda t, q, v: None if t >= 0.1 else [0, 0], events=events, **how).q[2]).all()


def test_runs_that_end_early_keep_what_they_have():
    blows_up = lambda t, q, v: 3 * np.sign(v) * v**2 + 1.0
    with np.errstate(all="ignore"), pytest.warns(RuntimeWarning, match=r"the run ended at .* s of 9 s: .*Rows after that are NaN"):
        run = M.simulate(*START[:2], [0.0, 0.001, 9.0], efforts=blows_up)
    assert not run.complete and np.isfinite(run.q[:2]).all() and np.isnan(run.q[2]).all() and 0.001 < run.ended < 9
    with pytest.warns(RuntimeWarning, match="it takes more steps than most_steps, 3; "):
        assert M.simulate(*START[:2], [0.0, 5.0], most_steps=3).steps <= 3
    for number, said in ((2, "^run 1, the first of 2, ended at"), (1, "^run 1 ended at")):
        with pytest.warns(RuntimeWarning, match=said) as told:
            runs = M.simulate([START[0]] * 3, np.array([[0, 0], [1e200, 0], [1e200 * (number - 1), 1]]), [0.0, 0.1], method="rk4", step=0.01)
        assert list(runs.complete) == [True, False, number == 1] and np.isfinite(runs.q[0]).all() and told[0].filename == __file__


@pytest.mark.parametrize("method", ["semi_implicit_euler", "rk4", "rkmk4", "sdirk4", "variational"])
@pytest.mark.parametrize("more", [{}, {"events": lambda t, q, v: 1.0}], ids=["alone", "events"])
def test_runs_of_equal_steps_end_at_the_state_before_numbers_fail(method, more):
    """Not at the time of results before it; and the first time at which the function failed is told."""
    if method == "variational" and more:
        more = {}
    with np.errstate(all="ignore"), pytest.warns(RuntimeWarning, match=r"efforts returned nan at t = 0\.07[0-5]* s") as told:
        run = M.simulate(*START[:2], [0.0, 1.0, 2.0], efforts=lambda t, q, v: [np.nan if t > 0.0699 else 0.0, 0.0], method=method, step=0.01, **more)
    assert 0.059 < run.ended < 0.071 and run.steps <= 7 and run.reason == "numbers are not finite" and len(told) == 1


def test_a_step_that_is_no_step_is_told():
    with pytest.warns(RuntimeWarning, match="it takes more steps than most_steps, 10,000,000; take longer steps"):
        assert M.simulate(*START, method="rk4", step=1e-300).steps == 0
    with pytest.warns(RuntimeWarning, match="too small to go on"):  # 1 s is eight numbers there
        assert not M.simulate(*START[:2], [1e15, 1e15 + 1]).complete


@pytest.mark.parametrize("method", ["semi_implicit_euler", "rk4", "rkmk4", "dop853", "sdirk4", "variational"])
def test_robots_that_can_not_move(method):
    m = ksl.Builder("rock").add_link("world").add_link("rock", mass=1.0).add_joint("fixed", "fixed", "world", "rock").build()
    step, laws = {} if method == "dop853" else {"step": 0.1}, {} if method == "variational" else {"friction": 1.0, "brake": Brake(1.0, 0.5)}
    efforts = {"none": None, "numbers": np.zeros((2, 0)), "a function": lambda t, q, v: q, "a controller": PD([], 1.0, 1.0)}
    for drive in efforts.values():
        for leading in ((), (3,)):
            run = m.simulate(np.zeros((*leading, 0)), np.zeros((*leading, 0)), [0.0, 1.0], efforts=drive, method=method, **step)
            assert run.complete.all() and run.q.shape == (*leading, 2, 0)
    assert m.simulate([], [], [0.0, 1.0], method=method, events=lambda t, q, v: t - 0.5, **step, **laws).complete


def test_large_speeds_end_a_run_without_a_warning_of_numpy():
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        M.simulate(np.array(START[0]), np.array([1e160, 0.0]), START[2])
    assert len(said) == 1 and "numbers are not finite" in str(said[0].message)


def test_what_stands_at_zero_has_no_error():
    """Relative to nothing."""
    run = M.simulate([0.0, 0.0], [0.0, 0.0], START[2], rtol=1e-9, atol=0.0)
    assert run.complete and not run.q.any()


def test_a_function_may_ask_for_too_much_in_a_step_that_is_tried_again():
    def efforts(t, q, v):
        return [np.nan, 0.0] if abs(v[0]) > 3.0 else [-4 * v[0], 0.0]  # beyond what the motion reaches

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert M.simulate(*START, efforts=efforts, rtol=1e-3, atol=1e-3).complete


def test_closed_mechanisms():
    m = four_bar()
    q = m.close([-1.0, 0.4, -1.5], hold=["A"]).q
    v = m.consistent_velocity(q, [3.0, 0, 0], given=["A"])
    with pytest.raises(ValueError, match=r"^simulate: loop joint C is open .* close\(q\) gives"):
        m.simulate(q + 0.1, v, [0, 1])
    with pytest.raises(ValueError, match="^simulate: .*consistent_velocity gives"):
        m.simulate(q, v + 1, [0, 1])
    times = np.linspace(0, 1, 11)
    exact = m.simulate(q, v, times, rtol=1e-12, atol=1e-12)
    assert np.abs(exact.drift.energy).max() < 1e-9 and exact.drift.closure.max() < 1e-9
    assert np.abs(m.loop_error(exact.q)).max() < 1e-11
    loose = m.simulate(q, v, times, method="semi_implicit_euler", step=1e-3, project=False)
    assert loose.drift.closure[-1] > 1e-5
    fine = m.simulate(q, v, np.linspace(0, 0.5, 501))
    turned = m.simulate(q, v, fine.times, efforts=ComputedTorque(Reference(fine.times, fine.q, fine.v, fine.a), stiffness=100.0, damping=20.0))
    assert np.abs(turned.q - fine.q).max() < 1e-4 and np.abs(turned.efforts[:, 1:]).max() == 0
    stopped = m.simulate(q, v, times, brake=Brake({"A": 30.0}, at=0.2))
    assert stopped.events[-1].what == "sticks" and np.abs(stopped.v[-1]).max() < 1e-9


@pytest.mark.parametrize("method", ["semi_implicit_euler", "rk4", "rkmk4", "dop853"])
def test_closed_runs_have_the_bits_of_single_ones(method):
    """More runs than a block of the model's plan has; states that it doesn't fit are computed alone."""
    m = four_bar()
    free = np.random.default_rng(5).uniform(-2, 0, 70)
    q = np.array([m.close([x, 0.4, -1.5], hold=["A"]).q for x in free])
    v = np.array([m.consistent_velocity(x, [3.0, 0, 0], given=["A"]) for x in q])
    times, options = [0.0, 0.004, 0.01], {"external": {"rocker": [0, 0, 5.0, 0, 0, 0]}, "method": method} | ({} if method == "dop853" else {"step": 2e-3})
    runs = m.simulate(q, v, times, threads=2, **options)
    assert np.abs(m.loop_error(runs.q)).max() < 1e-11
    for i in (0, 9, 63, 64, 69):
        one = m.simulate(q[i], v[i], times, **options)
        for name in ("q", "v", "a", "efforts", "work", "energy"):
            assert np.array_equal(getattr(one, name), getattr(runs, name)[i]), name
    if method == "dop853":  # under a law each state has pivots of its own
        others = m.simulate(q, v, times, brake=Brake({"A": 30.0}, at=9.0), **options)
        assert np.abs(others.q - runs.q).max() < 1e-9 and np.abs(others.a - runs.a).max() < 1e-6


def test_progress_is_told_and_ctrl_c_ends_the_call():
    told = []
    M.simulate(*START[:2], [0.0, 30.0], method="rk4", step=1e-4, progress=told.append)
    assert told == sorted(told) and all(0 < t <= 30.0 for t in told)
    import _thread

    threading.Timer(0.2, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        M.simulate(*START[:2], [0.0, 1e6], method="rk4", step=1e-3, most_steps=2**60)
    with pytest.raises(KeyError, match="of mine"):
        M.simulate(*START[:2], [0.0, 1e6], method="rk4", step=1e-3, most_steps=2**60, progress=lambda t: {}["of mine"])


def test_singular_positions_are_events():
    """A four-bar of equal rods, whose equations lose rank where all rods lie on one line."""
    m = equal_four_bars(1)
    q = m.neutral()
    v = m.consistent_velocity(q, np.where(np.arange(3) == m.joint("rod_0").v_index, 1.0, 0.0), given=["rod_0"])
    for tolerance in (1e-12, 1e-9):  # by the tighter one there are many steps where pivots are but rounding
        run = m.simulate(q, v, [0, 2.0 if tolerance == 1e-9 else 0.8], rtol=tolerance, atol=tolerance)
        assert [event.what for event in run.events] == ["singular"] * (1 + (tolerance == 1e-9)) and run.complete
    for event, turned in zip(run.events, (1, 3), strict=True):
        assert m.simulate(q, v, [0, event.time]).q[-1, m.joint("rod_0").q_index] == pytest.approx(turned * np.pi / 2, abs=1e-6)


def test_one_line_says_what_a_run_is():
    assert repr(M.simulate(*START)).startswith("<ksl simulation: to 0.2 s, ")
    assert "2 runs, 2 complete" in repr(M.simulate([START[0]] * 2, *START[1:]))
    run = M.simulate(*START, method="rk4", step=0.02)  # four evaluations a step, and one where it begins
    assert (run.steps, run.rejected, run.evaluations) == (10, 0, 41)


def test_a_drive_that_switches_to_and_fro_ends_early():
    """Beyond its zero it pushes back with a jump: no step is short enough.  The run says where, and keeps what it has."""
    m = (
        ksl.Builder("wheel")
        .add_link("base")
        .add_link("wheel", mass=1.0, inertia=np.eye(3))
        .add_joint("turn", "continuous", "base", "wheel", axis=(0, 0, 1))
        .build()
    )
    with pytest.warns(RuntimeWarning, match="became too small to go on; joint 'turn' .* energy"):
        run = m.simulate([0.0], [1e-6], [0, 1.0], efforts=lambda t, q, v: -1e9 * np.sign(v + 1e-9))
    assert run.steps + run.rejected <= 30_000 and np.isfinite(run.q[0]).all() and np.isnan(run.q[1]).all()


# the numbers that the compiled call gets


def test_laws_are_those_of_the_joints_that_are_named():
    laws = M._exact_laws({"to_lower": 0.5}, {"to_upper": 2.0}, Brake({"to_lower": 3.0}, 0.25), np.zeros((1, 2)))
    assert laws["restitution"].tolist() == [-1.0, 0.5] and laws["friction"].tolist() == [2.0, 0.0] and laws["brake"].tolist() == [0.0, 3.0]
    assert (laws["lower"].tolist(), laws["upper"].tolist(), laws["brake_at"]) == ([-2.0, -2.0], [2.0, 2.0], 0.25) and laws["cut_efforts"] is True
    assert M._exact_laws(None, None, None, np.zeros((1, 2))) == {
        "restitution": None, "lower": None, "upper": None, "friction": None, "brake": None, "brake_at": 0.0, "cut_efforts": False,
    }  # fmt: skip
    at_limits = np.array([[-2.0, 2.0], [2.0, -2.0]])
    assert M._exact_laws(0.5, None, None, at_limits)["restitution"].tolist() == [0.5, 0.5]
    assert M._exact_laws({"to_lower": 0.0}, None, None, np.array([[2.5, 0.0]]))["restitution"].tolist() == [-1.0, 0.0], (
        "a joint that is left out may start anywhere"
    )
    for q, said in (
        (np.array([[0.0, 0.0], [0.0, 2.0000001]]), "'to_lower' starts at 2, beyond"),
        (np.array([[-2.1, 0.0]]), "'to_upper' starts at -2.1, beyond its limits -2 and 2"),
    ):
        with pytest.raises(ValueError, match=said):
            M._exact_laws(0.0, None, None, q)


def test_coordinates_of_laws_and_limits_differ_behind_a_ball():
    """A spherical joint has four numbers of q and three of v: limits are those of the hinge behind it."""
    b = ksl.Builder("ball").add_link("base").add_link("a", 1.0, inertia=np.eye(3)).add_link("b", 1.0, inertia=np.eye(3))
    b.add_joint("ball", "spherical", "base", "a", friction=0.1).add_joint("hinge", "revolute", "a", "b", axis=(0, 0, 1), limits=(-0.5, 0.25))
    m = b.build()
    k = m.joint("hinge").v_index
    laws = m._exact_laws(0.5, 3.0, None, m.neutral()[np.newaxis])
    assert (laws["lower"][k], laws["upper"][k], laws["restitution"][k], laws["friction"][k]) == (-0.5, 0.25, 0.5, 3.0)
    others = [j for j in range(m.nv) if j != k]
    assert set(laws["restitution"][others]) == {-1.0} and not laws["friction"][others].any() and set(laws["lower"][others]) == {-np.inf}
    turning = m.with_physics("exact friction").simulate(m.neutral(), [0.0, 0.0, 0.1, 0.0], [0, 2.0])
    assert [(event.what, event.joint, event.coordinate) for event in turning.events] == [("sticks", "ball", 2)]
    q = m.neutral()
    q[m.joint("hinge").q_index] = 0.3
    with pytest.raises(ValueError, match="'hinge' starts at 0.3, beyond its limits -0.5 and 0.25"):
        m._exact_laws(0.5, None, None, q[np.newaxis])


def test_numbers_at_their_bounds_are_taken():
    """A relative error of zero beside an absolute one, a step that is not needed at a single time, and steps counted by NumPy."""
    for named in ({"rtol": 0.0}, {"rtol": 1e-300}, {"most_steps": np.int64(700)}):
        assert M.simulate(*START, **named).complete.all()
    for named in ({"method": "rk4"}, {"method": "rk4", "step": 1e-300}):
        assert M.simulate(*START[:2], [2], **named).q.tolist() == [START[0]]
    assert M.simulate(*START[:2], [2], most_steps=1).times.dtype == float


@pytest.mark.parametrize(("direction", "slopes"), [(0, {-1, 1}), (3.5, {1}), (-0.1, {-1})])
def test_the_sign_of_a_direction_chooses_zeros(direction, slopes):
    """Of the upper link's angle, beside an event that never comes."""

    def crosses(t, q, v):
        return q[0]

    crosses.direction = direction
    run = M.simulate(*START[:2], np.linspace(0.0, 3.0, 301), events=[lambda t, q, v: 1.0, crosses])
    assert {np.sign(np.interp(event.time, run.times, run.v[:, 0])) for event in run.events} == slopes
    assert all(event.coordinate == 1 and abs(np.interp(event.time, run.times, run.q[:, 0])) < 1e-3 for event in run.events)


def test_momentum_that_is_lost_is_less_than_what_gravity_gives():
    """Of a body that begins to move at 3 s: m g t, from the beginning on; a robot on the ground has none."""
    b = ksl.Builder("body", gravity=(1.0, 0.0, -9.81)).add_link("body", 2.0, inertia=np.eye(3))
    m = b.build(floating_base=True)
    run = m.simulate(m.neutral(), [1.0, 2.0, 3.0, 0.0, 0.0, 0.5], [3.0, 3.5, 4.0])
    assert np.abs(run.drift.momentum).max() < 1e-9 and run.drift.momentum.shape == (3, 6)
    assert M.simulate(*START).drift.momentum is None
    two = b.add_link("arm", 1.0, (0.1, 0, 0), inertia=np.eye(3)).add_joint("j", "revolute", "body", "arm", axis=(0, 1, 0)).build(floating_base=True)
    assert np.abs(two.simulate(two.neutral(), np.arange(7.0), [0.0, 0.1]).drift.momentum).max() < 1e-8
    for axes, moved in (("link", (0.02, 0.1)), ("world", (0.12, 0.0))):  # a force of 10 N along x, of the body or of the world, that is a quarter turn apart
        run = m.simulate(
            m.integrate(m.neutral(), [0, 0, 0, 0, 0, np.pi / 2]), np.zeros(6), [0.0, 0.2], external={"body": [10.0, 0, 0, 0, 0, 0]}, external_axes=axes
        )
        assert run.drift.momentum is None and np.abs(run.q[-1, :2] - moved).max() < 1e-9 and run.energy[-1] == pytest.approx(10 * max(moved))


@pytest.mark.parametrize(("runs", "said"), [(3, r"run 0, the first of 3, ended at"), (1, "the run ended at")])
def test_which_of_several_runs_ended_early_is_told(runs, said):
    q, v = ([[0.8, 0.2]] * runs, [[0.0, 0.0]] * runs) if runs > 1 else START[:2]
    with pytest.warns(
        RuntimeWarning, match=rf"{said} .*it takes more steps than most_steps, 3; take longer steps.*; its energy was .* J\.  Rows after that are NaN"
    ):
        run = M.simulate(q, v, [0.0, 5.0], most_steps=3)
    assert not np.any(run.complete)


def test_momentum_is_counted_from_the_first_time():
    """Of a body that falls freely, whatever its clock says at the start."""
    m = ksl.Builder("stone").add_link("stone", 2.0, (0.1, 0, 0), 0.1 * np.eye(3)).build(floating_base=True)
    run = m.simulate(m.neutral(), [0.3, 0, 1.0, 2.0, -1.0, 0.5], [5.0, 5.1, 5.3])
    assert run.kinetic[-1] > 3 and np.abs(run.drift.momentum).max() < 1e-8


def test_energies_that_are_not_finite_are_said():
    m = ksl.Builder("stone").add_link("stone", 2.0, (0.1, 0, 0), 0.1 * np.eye(3)).build(floating_base=True)
    with pytest.warns(
        RuntimeWarning, match=r"the run: its energy or the work done on it is not finite at 0\.\d+ s: velocities, efforts or wrenches are too large"
    ) as told:
        m.simulate(m.neutral(), np.zeros(6), [0.0, 0.001], external={"stone": [1e160, 0, 0, 0, 0, 0]})
    assert told[0].filename == __file__
