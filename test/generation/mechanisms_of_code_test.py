"""Code of mechanisms that are more than trees of joints: mimic joints, force elements, loops."""

import numpy as np
import pytest
from generated_code import EXAMPLES, FLAGS, FOLLOWED, call, check_bits, compiled, on_struts, rows_of, run, spatial_four_bar

import ksl
from ksl.generation import self_test
from ksl.generation.arguments import arguments_given
from ksl.generation.requests import functions_of

OF_TREES = ("mass_matrix_tree", "mass_matrix_factor")
"""What isn't there with mimic joints."""
TWICE = ("inverse_dynamics_second_derivatives", "forward_dynamics_second_derivatives")


@pytest.mark.parametrize("scalar", ["double", "float"])
def test_mimic_joints_follow_to_the_bit_in_all_that_the_engine_has(tmp_path, scalar):
    m = ksl.load_string(FOLLOWED)
    asked = rows_of(m, ("l2", "l1"), ("thumb",), OF_TREES)
    assert check_bits(m, asked, tmp_path, scalar, ["external:l2+l0"]) > 1000
    with pytest.raises(ValueError, match="not available for robots with mimic joints"):
        ksl.generate(m, ["mass_matrix_tree"], tmp_path / "out")


@pytest.mark.parametrize("mimic, refused, compiler", [(("shoulder", -0.5, 0.1), OF_TREES, "gcc"), (None, (), "clang")])
def test_force_elements_have_the_bits_of_the_engine(tmp_path, mimic, refused, compiler):
    """With a follower, and without; payload and gravity act beside them."""
    m = on_struts(mimic=mimic).build(physics="all")
    asked = rows_of(m, ("hand", "lower"), ("elbow",), (*refused, *TWICE))
    assert check_bits(m, asked, tmp_path, arguments=["external:hand", "gravity"], compiler=compiler) > 1000
    with pytest.raises(ValueError, match="not available with force elements"):
        ksl.generate(m, [TWICE[0]], tmp_path / "out")


def test_force_elements_in_float_err_at_most_twice_as_much_as_the_engine(tmp_path):
    """The engine computes these forces in double."""
    m, rng, n = on_struts().build(physics="all"), np.random.default_rng(1), 300
    rows = {"inverse_dynamics": (3, 1), "forward_dynamics": (3, 1), "energy": (2, 2), "inverse_dynamics_derivatives": (3, 3)}
    ksl.generate(m, list(rows), tmp_path, name="p", scalar="float")
    code = compiled(tmp_path, "p")

    def engine(row, given, scalar):
        found = getattr(m, row)(*(x.astype(scalar) for x in given))
        return np.hstack([x.reshape(n, -1) for x in (found if isinstance(found, tuple) else (found,))])

    for row, (inputs, results) in rows.items():
        given = [x.astype(np.float32) for x in (m.random(2, size=n), *rng.normal(size=(2, n, m.nv)))][:inputs]
        exact, single = (engine(row, given, scalar) for scalar in (float, np.float32))
        found = np.vstack(
            [np.hstack(call(getattr(code, f"p_{row}"), [x[k] for x in given], results * [exact.shape[1] // results], np.float32)) for k in range(n)]
        )
        for size in (np.std, np.max):
            errors = [size(np.abs(x - exact)) for x in (found, single)]
            assert errors[0] <= (3 if row.endswith("derivatives") else 2) * errors[1], row


def test_points_that_meet_and_lengths_beyond_limits_are_nan(tmp_path):
    b = ksl.Builder("slide").add_link("base").add_link("slide", 1.0).add_joint("x", "prismatic", "base", "slide", axis=(1, 0, 0))
    m = b.add_force_element("spring", "base", (1, 0, 0), "slide", (0, 0, 0), stiffness=10.0, free_length=0.5, limits=(None, 2.0)).build(physics="all")
    ksl.generate(m, ["gravity_torque"], tmp_path, name="p")
    code = compiled(tmp_path, "p")
    found = [call(code.p_gravity_torque, [np.array([x])], [1])[0][0] for x in (0.25, 1.0, 4.0)]
    assert found[0] == m.gravity_torque([0.25])[0] and np.isnan(found[1:]).all()


@pytest.mark.parametrize("robot", ["andrews", "governor"])
def test_closed_mechanisms_on_springs_have_the_bits_of_their_plan(tmp_path, robot):
    m = ksl.load(EXAMPLES / f"{robot}.urdf", physics="all")
    rows = [row for row in ("inverse_dynamics", "forward_dynamics", "bias", "gravity_torque", "effort_parts", "energy") if row != "bias" or m.drives]
    assert check_bits(m, rows, tmp_path, states=10) > 100


def test_derivatives_along_a_closed_mechanism_have_the_bits_of_its_plan(tmp_path):
    m = ksl.load(EXAMPLES / "excavator.urdf")
    rows = ["inverse_dynamics_derivatives", "forward_dynamics_derivatives"]
    assert check_bits(m, rows, tmp_path, arguments=["external:bucket"]) > 500
    assert "those of the drives: " in (tmp_path / "p.h").read_text()


def test_what_is_linear_has_the_bits_of_the_plan(tmp_path):
    """Regressors, and reactions by external wrenches; some with more drives than freedoms."""
    m = ksl.load(EXAMPLES / "excavator.urdf")
    assert check_bits(m, ["inverse_dynamics_regressor:bucket", "gravity_torque_regressor"], tmp_path / "0", states=4) > 1000
    for drives in (["drive"], ["drive", "hinge"]):
        asked = ["reactions_regressor:elbow+ball", "reactions_external_derivatives:ball"]
        assert check_bits(spatial_four_bar(drives), asked, tmp_path / str(len(drives)), states=3) > 500
    with pytest.raises(ValueError, match="as many drives as it has freedoms"):
        ksl.generate(spatial_four_bar(drives), ["inverse_dynamics_regressor"], tmp_path / "out")
    with pytest.raises(ValueError, match="not determined by rigid bodies"):
        ksl.generate(m, ["reactions_regressor:boom_foot"], tmp_path / "out")


def test_rods_that_turn_idly_have_the_bits_of_the_plan_and_nan_where_they_would_need_a_moment(tmp_path):
    m, rng = ksl.load(EXAMPLES / "two_rod_ankle.urdf"), np.random.default_rng(2)
    asked = ["inverse_dynamics", "forward_dynamics", "gravity_torque", "effort_parts"]
    assert check_bits(m, asked, tmp_path, states=2) == 2 * 8 * m.nv
    run("gcc", *FLAGS, "p.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
    run(tmp_path / "test", cwd=tmp_path)
    aside, *spin = rng.normal(size=(3, m.nv))
    q = m.close(m.integrate(m.close(m.neutral()).q, 0.05 * aside)).q
    v = m.consistent_velocity(q, spin[0], given=m.independent(q))
    a = m.consistent_acceleration(q, v, spin[1], given=m.independent(q))
    with pytest.raises(ksl.ResultError, match="turns idly"):
        m.inverse_dynamics(q, v, a)
    assert np.isnan(call(compiled(tmp_path, "p").p_inverse_dynamics, [q, v, a], [m.nv])[0]).any()


def test_each_result_is_nan_where_loops_are_open(tmp_path):
    m = ksl.load(EXAMPLES / "excavator.urdf")
    asked = ["inverse_dynamics_derivatives", "forward_dynamics_derivatives", "vjp.inverse_dynamics", "inverse_dynamics_regressor", "jvp.frame_pose:bucket"]
    asked += ["inverse_dynamics_with_reactions", "reactions", "effort_parts"]
    z = [np.zeros(m.nv)] * 2
    for f in functions_of(m, asked, arguments_given(m, ()), False, "least-norm"):
        inputs = [m.random(1), *z, np.ones(m.nv)][: len(f.recording.inputs)]
        assert all(np.isnan(x).any() for x in f.recording.play(inputs)), f.name


def test_sizes_of_pivots_tell_where_results_are_nan(tmp_path, monkeypatch):
    m, rng = ksl.load(EXAMPLES / "excavator.urdf"), np.random.default_rng(1)
    ksl.generate(m, ["inverse_dynamics", "gravity_torque", "frame_pose:bucket"], tmp_path, name="p", pivots=True, lanes=4)
    run("gcc", *FLAGS, "p.c", "p_lanes.c", "p_test.c", "-fno-math-errno", "-Wno-psabi", "-o", "test", "-lm", cwd=tmp_path)
    run(tmp_path / "test", cwd=tmp_path)
    header = (tmp_path / "p.h").read_text()
    assert (
        "double *tau, double *pivots);" in header
        and "void p_frame_pose_bucket(const double *q, double *pose);" in header
        and "#define P_LEAST_PIVOT 0.01" in header
    )
    code, start, seen = compiled(tmp_path, "p"), m.close(m.neutral()).q, {}
    n = int(header.split("pivots (")[1].split(")")[0])
    for size in np.geomspace(0.05, 3, 60):
        found = m.close(m.integrate(start, rng.normal(size=m.nv) * size))
        if found.converged:
            tau, pivots = call(code.p_gravity_torque, [np.ascontiguousarray(found.q)], [m.nv, n])
            assert np.isnan(tau).all() == (pivots.min() < 0.01)
            seen[bool(np.isnan(tau).all())] = found.q
    assert set(seen) == {False, True}
    closed = iter([seen[True], *[seen[False]] * 3])
    monkeypatch.setattr(self_test, "closed_position", lambda model, rng: next(closed))
    ksl.generate(m, ["gravity_torque"], tmp_path, name="p")  # its self-test is of states that have results
    run("gcc", *FLAGS, "p.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
    run(tmp_path / "test", cwd=tmp_path)
    with pytest.raises(ValueError, match="pivots"):
        ksl.generate(m, ["frame_pose:bucket"], tmp_path / "out", pivots=True)
