"""Functions for CasADi: the engine's bits, the engine's derivatives, and what CasADi makes of both."""

import subprocess
import sys

import numpy as np
import pytest
from generated_code import EXAMPLES, FLAGS, run

import ksl
from ksl.base.errors import ArgumentError

cs = pytest.importorskip("casadi", reason="needs casadi: pip install 'ksl[casadi]'")


def listed(x):
    return x if isinstance(x, tuple) else (x,)


def jacobians(f, *given):
    """Dense blocks, those of the first result first."""
    return [block.full() for block in listed(f.jacobian()(*given, *(0 for _ in range(f.n_out()))))]


def close(found, expected, bound=1e-12):
    assert np.abs(found - expected).max() <= bound * np.abs(expected).max()


def test_external_gives_the_engines_bits_and_its_derivatives(ur5, tmp_path):
    ksl.generate(ur5, ["inverse_dynamics", "forward_dynamics", "mass_matrix", "jacobian:tool0"], tmp_path, name="p", abi="casadi")
    run("gcc", *FLAGS, "-fPIC", "-shared", "p_casadi.c", "-o", "p_casadi.so", "-lm", cwd=tmp_path)
    made = {
        name: cs.external(f"p_casadi_{name}", str(tmp_path / "p_casadi.so"))
        for name in ("inverse_dynamics", "forward_dynamics", "mass_matrix", "jacobian_tool0")
    }
    q, v, x = np.random.default_rng(1).normal(size=(3, 6))
    assert np.array_equal(made["inverse_dynamics"](q, v, x).full()[:, 0], ur5.inverse_dynamics(q, v, x))
    assert np.array_equal(made["forward_dynamics"](q, v, x).full()[:, 0], ur5.forward_dynamics(q, v, x))
    assert np.array_equal(made["mass_matrix"](q).full(), ur5.mass_matrix(q))
    assert np.array_equal(made["jacobian_tool0"](q).full(), ur5.jacobian(q, "tool0"))
    for name in ("inverse_dynamics", "forward_dynamics"):
        for found, expected in zip(jacobians(made[name], q, v, x), getattr(ur5, f"{name}_derivatives")(q, v, x), strict=True):
            close(found, expected)
    # tau(q, 0, a) - tau(q, 0, 0) = M a, so by the product rule the Jacobian of M a by q is a difference of two of tau
    columns = jacobians(made["mass_matrix"], q)[0].reshape(6, 6, 6, order="F")  # (row, column, q)
    still = [ur5.inverse_dynamics_derivatives(q, np.zeros(6), a)[0] for a in (x, np.zeros(6))]
    close(np.einsum("ijk,j->ik", columns, x), still[0] - still[1])


def test_reactions_energies_and_poses(ur5):
    q, v, a = np.random.default_rng(2).normal(size=(3, 6))
    joints = ["elbow", "wrist_1"]
    f = ksl.casadi_function(ur5, "reactions:elbow+wrist_1")
    assert (f.name(), f.name_in(), f.name_out()) == ("reactions", ["q", "v", "a"], ["wrenches"])
    assert np.array_equal(f(q, v, a).full(), ur5.reactions(q, v, a, joints=joints))
    for found, expected in zip(jacobians(f, q, v, a), ur5.reactions_derivatives(q, v, a, joints=joints), strict=True):
        close(found, expected.swapaxes(0, 1).reshape(12, 6))  # CasADi counts elements column by column
    kinetic_by_q, kinetic_by_v, potential_by_q = ur5.energy_derivatives(q, v)
    energy = ksl.casadi_function(ur5, "energy")
    for found, expected in zip(jacobians(energy, q, v)[:3], (kinetic_by_q, kinetic_by_v, potential_by_q)):
        close(found[0], expected)
    assert energy.jacobian().sparsity_out(3).nnz() == 0  # of the potential by velocities
    pose = ksl.casadi_function(ur5, "frame_pose:tool0")
    assert pose.sparsity_out(0).nnz() == 13 and np.array_equal(pose(q).full(), ur5.frame_pose(q, "tool0"))


def test_second_derivatives_are_those_of_the_engine(ur5):
    q, v, a, w = np.random.default_rng(3).normal(size=(4, 6))
    f = ksl.casadi_function(ur5, "inverse_dynamics", derivatives=2)
    given = [cs.MX.sym(name, 6) for name in "qva"]
    weighted = cs.dot(w, f(*given))
    hessian = cs.Function(
        "hessian", given, [cs.jacobian(cs.gradient(weighted, x), y) for x, y in ((given[0], given[0]), (given[1], given[1]), (given[0], given[1]))]
    )
    for found, expected in zip(hessian(q, v, a), ur5.inverse_dynamics_second_derivatives(q, v, a)):
        close(found.full(), np.einsum("i,ikm->km", w, expected))
    assert ksl.casadi_function(ur5, "inverse_dynamics").jacobian().n_out() == 3


def test_quaternions_by_their_numbers():
    """Along a motion the derivatives by the numbers of q, times how these change, are those by joint velocities."""
    m = ksl.load(EXAMPLES / "ur5.urdf", floating_base=True)
    q, (v, a) = m.random(4), np.random.default_rng(4).normal(size=(2, m.nv))
    f, integrate = ksl.casadi_function(m, "inverse_dynamics"), ksl.casadi_function(m, "integrate")
    by_q, by_v, by_a = jacobians(f, q, v, a)
    moved = jacobians(integrate, q, np.zeros(m.nv))[1]
    for found, expected in zip((by_q @ moved, by_v, by_a), m.inverse_dynamics_derivatives(q, v, a)):
        close(found, expected)


def test_inputs_besides_and_those_that_are_not_given(ur5):
    f = ksl.casadi_function(ur5, "inverse_dynamics", arguments=["external:tool0+forearm_link", "gravity", "payload:tool0"])
    q, v, a = np.random.default_rng(5).normal(size=(3, 6))
    wrenches, gravity = np.random.default_rng(6).normal(size=(2, 6)), (1.0, 2.0, -3.0)
    expected = ur5.with_gravity(gravity).inverse_dynamics(q, v, a, external={"tool0": wrenches[0], "forearm_link": wrenches[1]})
    assert np.array_equal(f(q, v, a, wrenches.T, gravity, 0).full()[:, 0], expected)
    by = dict(zip(f.name_in(), jacobians(f, q, v, a, wrenches.T, gravity, 0)))
    close(by["gravity"], np.stack([ur5.with_gravity(e).gravity_torque(q) for e in np.eye(3)], axis=1))
    close(by["payload"], ur5.with_gravity(gravity).inverse_dynamics_regressor(q, v, a)[:, ur5.link_names.index("tool0")])
    close(by["external"][:, :6], -ur5.jacobian(q, "tool0").T)
    assert np.array_equal(f.call({"v": v, "a": a})["tau"].full()[:, 0], ur5.with_gravity((0, 0, 0)).inverse_dynamics(np.zeros(6), v, a))


def test_a_reaction_is_bounded_while_an_arm_moves(ur5):
    """A motion of low effort from rest to rest, whose moment across the elbow's bearing is bounded below that of the motion without a bound."""
    tau, reaction = (ksl.casadi_function(ur5, name, derivatives=2) for name in ("inverse_dynamics", "reactions:elbow"))
    start, end, n, h = np.array([0, -1.2, 1.2, -1, 0.5, 0]), np.array([1, -0.6, 0.6, -0.5, 0.5, 0]), 10, 0.08

    def solved(bound):
        opti = cs.Opti()
        q, v, a = (opti.variable(6, n + 1) for _ in range(3))
        opti.subject_to(cs.vec(q[:, 1:] - q[:, :-1] - h / 2 * (v[:, 1:] + v[:, :-1])) == 0)
        opti.subject_to(cs.vec(v[:, 1:] - v[:, :-1] - h / 2 * (a[:, 1:] + a[:, :-1])) == 0)
        for x, k, at in ((q, 0, start), (v, 0, 0), (q, n, end), (v, n, 0)):
            opti.subject_to(x[:, k] == at)
        opti.subject_to(cs.vertcat(*(cs.sumsqr(reaction(q[:, k], v[:, k], a[:, k])[3:5]) for k in range(n + 1))) <= bound**2)
        opti.minimize(sum(cs.sumsqr(tau(q[:, k], v[:, k], a[:, k])) for k in range(n + 1)) * 1e-3)
        opti.set_initial(q, np.linspace(start, end, n + 1).T)
        opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes", "max_iter": 200})
        found = opti.solve()  # raises where Ipopt doesn't converge
        q, v, a = (found.value(x).T for x in (q, v, a))
        assert np.abs(q[[0, -1]] - [start, end]).max() < 1e-6
        return np.linalg.norm(ur5.reactions(q, v, a, joints=["elbow"])[:, 0, 3:5], axis=1).max()

    free = solved(1e3)
    assert solved(0.97 * free) <= 0.97 * free * (1 + 1e-6)


def test_what_is_refused_says_what_to_do(ur5, tmp_path):
    with pytest.raises(ArgumentError, match="CasADi differentiates functions itself; ask for inverse_dynamics"):
        ksl.casadi_function(ur5, "vjp.inverse_dynamics")
    with pytest.raises(ArgumentError, match="derivatives=3: expected 1"):
        ksl.casadi_function(ur5, "inverse_dynamics", derivatives=3)
    for wrong, said in (({"abi": "acados"}, "expected c or casadi"), ({"abi": "casadi", "scalar": "float"}, "double precision")):
        with pytest.raises(ArgumentError, match=said):
            ksl.generate(ur5, ["inverse_dynamics"], tmp_path / "out", **wrong)
    with pytest.raises(ValueError, match="closed mechanism"):
        ksl.casadi_function(ksl.load(EXAMPLES / "excavator.urdf"), "mass_matrix")
    assert not (tmp_path / "out").exists()


def test_without_casadi_the_command_that_brings_it_is_said():
    code = f"import sys, importlib.util\nreal = importlib.util.find_spec\nimportlib.util.find_spec = lambda n, *x: None if n == 'casadi' else real(n, *x)\nimport ksl\nksl.casadi_function(ksl.load({str(EXAMPLES / 'ur5.urdf')!r}), 'energy')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "a function of CasADi needs the package casadi; install it with: pip install 'ksl[casadi]'" in done.stderr


def test_the_lines_of_the_page_bound_a_reaction(ur5):
    page = (EXAMPLES.parents[1] / "docs" / "c_code.md").read_text(encoding="utf-8")
    code = page.split("## CasADi")[1].split("```python\n")[1].split("```")[0]
    opti = cs.Opti()
    q, v, a = (opti.variable(6) for _ in range(3))
    scope = {"ksl": ksl, "casadi": cs, "m": ur5, "opti": opti, "q": q, "v": v, "a": a}
    exec(code, scope)
    assert opti.ng == 1 and scope["tau"](np.zeros(6), np.zeros(6), np.zeros(6)).shape == (6, 1)


@pytest.mark.parametrize("other", [{"contract": True}, {"flash": 10_000_000}])
def test_what_says_nothing_of_the_file_of_casadi_is_refused_beside_it(ur5, tmp_path, other):
    with pytest.raises(ArgumentError, match="leave .* out"):
        ksl.generate(ur5, ["energy"], tmp_path / "out", abi="casadi", **other)
    assert not (tmp_path / "out").exists()
