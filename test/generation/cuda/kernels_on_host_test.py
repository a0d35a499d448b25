"""Kernels, compiled by a compiler of C++ and run thread by thread, have the engine's bits: rows and coalesced, in double and in float."""

import sysconfig
from pathlib import Path

import numpy as np
import pytest
from generated_code import EXAMPLES, FOLLOWED
from on_host import Kernels

import ksl
from ksl.base.errors import ArgumentError
from ksl.generation.arguments import Arguments
from ksl.generation.cuda import device, order
from ksl.generation.cuda.kernels import kernels
from ksl.generation.requests import functions_of
from ksl.generation.rows import ROWS

NAMED = {"link": ":{0}", "frame": ":{0}", "relative": ":{0}+{1}"}
UNWRITTEN, STEPS_MANY = {"mass_matrix_upper"}, {"forward_dynamics_second_derivatives"}


def asked_of(m, tip, joint, but=()):
    """Every row of a mechanism, as it is asked for: those of all links of one alone, where matrices would be large."""
    for row, how in ROWS.items():
        if row not in but and row not in UNWRITTEN and how.external != "required" and row != "external_power":
            yield row + (
                f":{joint}"
                if row == "hybrid_dynamics"
                else f":{tip}"
                if row.startswith("operational")
                else NAMED.get(how.request, "").format(tip, m.link_names[0])
            )


def states(m, function, n, dtype):
    """Inputs of a function: positions of the model's own, and numbers of about 1, the first three of them large angles."""
    rng, given = np.random.default_rng(n), []
    for name, size in function.recording.inputs:
        if name.startswith("q") and size == m.nq:
            rows = np.stack([m.random(k + 1000 * (name == "q1")) for k in range(n)])
            rows[:3] *= 1 if m.nq > m.nv else np.array([[1e4], [4e8], [1e15]])
        else:
            rows = rng.normal(size=(n, size)) if name != "fraction" else rng.uniform(size=(n, size))
        given.append(rows.astype(dtype))
    return given


def engine(m, function, inputs):
    given = [x[:, 0] if name == "fraction" else x for (name, _), x in zip(function.recording.inputs, inputs)]
    found = getattr(m, function.row)(*given, **function.keywords)
    return found if isinstance(found, tuple) else (found,)


def check(m, asked, scalar, n, folder, layouts=("rows",), bits=True):
    """Compares all results of all states; returns how many numbers that were."""
    text, made = kernels(m, list(asked), scalar, layouts=layouts)
    code, dtype, compared = Kernels(text, made, folder), np.float64 if scalar == "double" else np.float32, 0
    for kernel in made:
        inputs = states(m, kernel.function, n, dtype)
        expected = engine(m, kernel.function, inputs)
        for x, y in zip(code(kernel.function.name, inputs, kernel.coalesced, wide=kernel.coalesced), expected, strict=True):
            y = np.asarray(y).reshape(x.shape)
            if bits:
                assert np.array_equal(x, y), kernel.name
            else:
                assert np.abs(x - y).max() <= (1e-12 if scalar == "double" else 1e-5) * max(1, np.abs(y).max()), kernel.name
            compared += x.size
    assert compared
    return compared


@pytest.mark.parametrize("scalar", ["double", "float"])
def test_every_row_has_the_engines_bits(ur5, tmp_path, scalar):
    check(
        ur5,
        asked_of(ur5, "tool0", "elbow", STEPS_MANY | {"inverse_dynamics_second_derivatives", "reactions_regressor", "reactions_derivatives"}),
        scalar,
        150,
        tmp_path,
    )


@pytest.mark.parametrize("scalar", ["double", "float"])
def test_the_coalesced_layout_has_them_too(ur5, tmp_path, scalar):
    check(
        ur5,
        ["inverse_dynamics", "forward_dynamics", "mass_matrix", "jacobian:tool0", "energy", "reactions", "inverse_dynamics_gradient"],
        scalar,
        150,
        tmp_path,
        ("soa",),
    )


FEW = [
    "inverse_dynamics",
    "forward_dynamics",
    "mass_matrix_inverse",
    "reactions",
    "energy",
    "centroidal_momentum_matrix",
    "frame_poses",
    "inverse_dynamics_derivatives",
    "integrate",
]


@pytest.mark.parametrize("scalar", ["double", "float"])
@pytest.mark.parametrize("robot", ["panda", "floating", "followed"])
def test_other_robots(tmp_path, robot, scalar):
    m = {
        "panda": lambda: ksl.load(EXAMPLES / "panda.urdf"),
        "floating": lambda: ksl.load(EXAMPLES / "ur5.urdf", floating_base=True),
        "followed": lambda: ksl.load_string(FOLLOWED),
    }[robot]()
    check(m, [row for row in FEW if robot != "followed" or row != "mass_matrix_inverse"], scalar, 70, tmp_path, ("rows", "soa"))


@pytest.mark.parametrize("scalar", ["double", "float"])
def test_long_functions_are_parts(ur5, tmp_path, monkeypatch, scalar):
    monkeypatch.setattr(device, "STRAIGHT", 100)
    monkeypatch.setattr(device, "PART", 60)
    text, _ = kernels(ur5, ["inverse_dynamics"], scalar)
    assert "__noinline__ void k_inverse_dynamics_part_9(" in text
    check(ur5, ["inverse_dynamics", "forward_dynamics", "mass_matrix"], scalar, 70, tmp_path, ("rows", "soa"))


@pytest.mark.parametrize("scalar", ["double", "float"])
def test_an_order_with_fewer_numbers_alive_has_the_same_bits(ur5, tmp_path, monkeypatch, scalar):
    recording = functions_of(ur5, ["mass_matrix"], Arguments(), scalar == "float", "refuse")[0].recording
    monkeypatch.setattr(order, "REGISTERS", 40)
    found = order.ordered(recording)
    assert 20 < order.most_alive(found) < order.most_alive(recording) < 70 and found.operations.tolist() != recording.operations.tolist()
    check(ur5, ["mass_matrix", "energy", "centroidal_momentum_matrix"], scalar, 40, tmp_path)


def test_closed_mechanisms_have_the_bits_of_their_plan_or_nan(tmp_path):
    m, rng, rows = ksl.load(EXAMPLES / "excavator.urdf"), np.random.default_rng(3), ["inverse_dynamics", "reactions", "forward_dynamics", "bias"]
    found = [m.close(m.integrate(m.close(m.neutral()).q, rng.normal(size=m.nv) * 0.1)) for _ in range(80)]
    q = np.array([x.q for x in found if x.converged])
    given = {"given": m.independent(q[0])}
    v = np.stack([m.consistent_velocity(x, rng.normal(size=m.nv), **given) for x in q])
    a = np.stack([m.consistent_acceleration(x, y, rng.normal(size=m.nv), **given) for x, y in zip(q, v)])
    text, made = kernels(m, rows, layouts=("rows", "soa"))
    code = Kernels(text, made, tmp_path)
    for kernel in made:
        inputs = (q, v, a)[: len(kernel.inputs)]
        served = np.isfinite(code(kernel.function.name, inputs, kernel.coalesced)[0]).all(axis=tuple(range(1, 1 + len(kernel.results[0][1]))))
        assert served.sum() > 0.7 * len(q)
        inputs = [x[served] for x in inputs]
        assert np.array_equal(code(kernel.function.name, inputs, kernel.coalesced)[0], engine(m, kernel.function, inputs)[0])
        assert np.isnan(code(kernel.function.name, [inputs[0] + 0.3, *inputs[1:]], kernel.coalesced)[0]).all()  # open


@pytest.mark.parametrize("coalesced", [False, True])
def test_strides_one_row_for_all_and_few_states(ur5, tmp_path, coalesced):
    layout = "soa" if coalesced else "rows"
    text, made = kernels(ur5, ["inverse_dynamics", "mass_matrix"], arguments=["gravity", "external:tool0"], layouts=(layout,))
    code, rng = Kernels(text, made, tmp_path), np.random.default_rng(1)
    gravity, push = np.array([[0.5, 1, -9]]), rng.normal(size=(1, 6))
    lighter = ur5.with_gravity(gravity[0])
    for n, wide in ((1, 0), (2, 3), (31, 0), (32, 1), (33, 0), (128, 0), (129, 7), (300, 0)):
        q, v, a = rng.normal(size=(3, n, 6))
        assert np.array_equal(code("mass_matrix", [q], coalesced, wide)[0], ur5.mass_matrix(q))
        (tau,) = code("inverse_dynamics", [q, v, a, push, gravity], coalesced, wide)
        assert np.array_equal(tau, lighter.inverse_dynamics(q, v, a, external={"tool0": np.repeat(push, n, axis=0)}))
    (tau,) = code("inverse_dynamics", [q[:1], v[:1], a, push, gravity], coalesced)
    assert np.array_equal(tau, lighter.inverse_dynamics(q[:1], v[:1], a, external={"tool0": np.repeat(push, n, axis=0)}))


def test_results_may_lie_where_inputs_are_and_long_rows_go_in_pieces(ur5, tmp_path):
    asked = ["inverse_dynamics", "reactions_external_derivatives", "vjp.reactions_external_derivatives"]
    text, made = kernels(ur5, asked, layouts=("rows", "soa"))
    code, rng = Kernels(text, made, tmp_path), np.random.default_rng(2)
    q, v, a = rng.normal(size=(3, 100, 6))
    expected = ur5.inverse_dynamics(q, v, a)
    for coalesced, there in ((False, v.copy()), (True, v.T.copy())):
        code.in_place("inverse_dynamics", [q, v, a], there, 1, coalesced)
        assert np.array_equal(there.T if coalesced else there, expected)
    (by_external,) = code("reactions_external_derivatives", [q])
    assert by_external[0].size == 1728 and np.array_equal(by_external, ur5.reactions_external_derivatives(q))
    weights = rng.normal(size=(100, 1728))
    for coalesced in (False, True):
        (by_q,) = code("reactions_external_derivatives_vjp", [q, weights], coalesced, wide=3)
        h = 1e-6 * rng.normal(size=q.shape)
        moved = (ur5.reactions_external_derivatives(q + h) - ur5.reactions_external_derivatives(q - h)).reshape(100, -1) / 2
        assert np.allclose((by_q * h).sum(axis=1), (moved * weights).sum(axis=1), rtol=1e-4, atol=1e-9)


def test_gradients_and_parameters_of_each_state(ur5, tmp_path):
    """Forward and backward are each other's transpose, and forward is what the engine's analytic derivatives say; every state has a tool of its own."""
    asked = ["inverse_dynamics", "jvp.inverse_dynamics", "vjp.inverse_dynamics"]
    text, made = kernels(ur5, asked, arguments=["parameters:tool0"])
    code, rng, n = Kernels(text, made, tmp_path), np.random.default_rng(7), 40
    q, v, a, q_dot, v_dot, a_dot, tau_bar = rng.normal(size=(7, n, 6))
    tools = ur5.link("tool0").parameters + np.array([1.0, 0.05, -0.1, 0.2, 0.06, 0.005, 0.0525, -0.01, 0.02, 0.0225]) * rng.uniform(0.5, 2, size=(n, 1))
    tools_dot = rng.normal(size=(n, 10))
    (tau,) = code("inverse_dynamics", [q, v, a, tools])
    (tau_dot,) = code("inverse_dynamics_jvp", [q, v, a, tools, q_dot, v_dot, a_dot, tools_dot])
    bars = code("inverse_dynamics_vjp", [q, v, a, tools, tau_bar])
    for k in range(n):
        own = ur5.with_parameters({"tool0": tools[k]})
        assert np.allclose(tau[k], own.inverse_dynamics(q[k], v[k], a[k]), rtol=1e-12, atol=1e-12)
        by_q, by_v, by_a = own.inverse_dynamics_derivatives(q[k], v[k], a[k])
        more = own.with_parameters({"tool0": tools[k] + np.eye(10)[0]}).inverse_dynamics(q[k], v[k], a[k]) - own.inverse_dynamics(q[k], v[k], a[k])
        still = code("inverse_dynamics_jvp", [x[k : k + 1] for x in (q, v, a, tools, q_dot, v_dot, a_dot)] + [np.zeros((1, 10))])[0][0]
        assert np.allclose(still, by_q @ q_dot[k] + by_v @ v_dot[k] + by_a @ a_dot[k], rtol=1e-11, atol=1e-11)
        of_mass = code("inverse_dynamics_jvp", [x[k : k + 1] for x in (q, v, a, tools)] + [np.zeros((1, 6))] * 3 + [np.eye(10)[:1]])[0][0]
        assert np.allclose(of_mass, more, rtol=1e-9, atol=1e-9)  # efforts are linear in it
    forward = (tau_bar * tau_dot).sum(axis=1)
    assert np.allclose(forward, sum((x * y).sum(axis=1) for x, y in zip(bars, (q_dot, v_dot, a_dot, tools_dot), strict=True)), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("which", range(2))
def test_a_kernel_that_does_not_wait_is_noticed(ur5, tmp_path, which):
    """Of both places where threads of a warp wait for each other: the witness of this file sees races."""
    text, made = kernels(ur5, ["inverse_dynamics"])
    head, kernel = text[: text.index('extern "C"')], text[text.index('extern "C"') :]
    parts = kernel.split("__syncwarp();")
    assert len(parts) == 3
    code = Kernels(head + ("__syncwarp();".join(parts[: which + 1]) + "__syncwarp();".join(parts[which + 1 :])), made, tmp_path)
    q, v, a = np.random.default_rng(3).normal(size=(3, 300, 6))
    assert not np.array_equal(code("inverse_dynamics", [q, v, a])[0], ur5.inverse_dynamics(q, v, a))


def test_results_that_are_not_written_whole_have_no_kernel(ur5, tmp_path):
    for ask in (lambda: kernels(ur5, ["mass_matrix_upper"]), lambda: ksl.generate(ur5, ["mass_matrix_upper"], tmp_path / "out", cuda=True)):
        with pytest.raises(ArgumentError, match="mass_matrix_upper leaves numbers of its result unwritten, and has no kernel"):
            ask()
    with pytest.raises(ArgumentError, match="mass_matrix_upper leaves numbers of its result unwritten, and has no function of many states"):
        ksl.generate(ur5, ["mass_matrix_upper"], tmp_path / "out", lanes=4)


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["double", "float"])
@pytest.mark.parametrize("robot", ["ur5", "panda", "floating", "talos"])
def test_every_row_of_large_robots_too_in_many_states(tmp_path, robot, scalar):
    """10,000 states of every row of arms, 100,000 of inverse dynamics; Talos, whose functions are parts, where they are of one link or of the whole."""
    if robot == "talos":
        file = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots/talos_data/robots/talos_reduced.urdf"
        if not file.exists():
            pytest.skip("pip install example-robot-data")
        m, tip, joint = ksl.load(file), "right_sole_link", "leg_left_4_joint"
        check(
            m,
            ["inverse_dynamics", "forward_dynamics", "mass_matrix", f"jacobian:{tip}", "reactions", "inverse_dynamics_derivatives", f"hybrid_dynamics:{joint}"],
            scalar,
            2000,
            tmp_path,
        )
        return
    m = ksl.load(EXAMPLES / ("panda.urdf" if robot == "panda" else "ur5.urdf"), floating_base=robot == "floating")
    check(m, ["inverse_dynamics"], scalar, 100_000, tmp_path, ("rows", "soa"))
    tip, joint = ("panda_flange", "panda_joint4") if robot == "panda" else ("tool0", "elbow")
    check(m, asked_of(m, tip, joint, STEPS_MANY), scalar, 10_000, tmp_path, bits=robot != "floating")
