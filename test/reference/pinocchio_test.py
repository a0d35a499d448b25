"""Every quantity that Pinocchio has, too, on a fixed and on a floating robot; needs its package, `pin`.

Left out is what is known to be wrong there: derivatives with universal joints and with joints that aren't numbered depth first."""

import warnings

import numpy as np
import pytest
from reference_test import FILES
from robots import all_robots

import ksl

pin = pytest.importorskip("pinocchio")

LOCAL, WORLD, ALIGNED = pin.ReferenceFrame.LOCAL, pin.ReferenceFrame.WORLD, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
WHERE = ((LOCAL, {"axes": "frame", "at": "frame"}), (WORLD, {"axes": "world", "at": "world"}), (ALIGNED, {"axes": "world", "at": "frame"}))


class Both:
    """A robot in both libraries; their order of joints is theirs, ours is in_q and in_v of it."""

    def __init__(self, name: str) -> None:
        path, self.floating = all_robots()[FILES[name]], name != "panda"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ksl.DescriptionWarning)
            self.m = ksl.load(path, floating_base=self.floating, mimic="independent")
        self.p = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer()) if self.floating else pin.buildModelFromUrdf(str(path))
        self.d = self.p.createData()
        self.ids = [self.p.getJointId("root_joint" if n == "floating_base" else n) for n in self.m.joint_names]
        joints = [self.p.joints[i] for i in self.ids]
        self.in_q = np.concatenate([np.arange(j.idx_q, j.idx_q + j.nq) for j in joints])
        self.in_v = np.concatenate([np.arange(j.idx_v, j.idx_v + j.nv) for j in joints])
        self.square = np.ix_(self.in_v, self.in_v)
        self.children = [self.m.joint(n).child for n in self.m.joint_names]
        self.links = [n for n in self.m.link_names if self.p.existFrame(n)]
        rng = np.random.default_rng(3)
        self.Q = np.stack([pin.randomConfiguration(self.p, -np.ones(self.p.nq), np.ones(self.p.nq)) for _ in range(2)])
        self.Q = self.Q if not self.floating else np.stack([pin.normalize(self.p, x) for x in self.Q])
        self.V, self.A, self.T = rng.normal(size=(3, 2, self.p.nv))
        self.q, self.v, self.a, self.tau = self.Q[0][self.in_q], self.V[0][self.in_v], self.A[0][self.in_v], self.T[0][self.in_v]
        wrenches = rng.normal(size=(len(self.ids), 6)) * 5
        self.external = dict(zip(self.children, wrenches))
        self.fext = pin.StdVec_Force()
        self.fext.extend(pin.Force.Zero() for _ in range(self.p.njoints))
        for i, w in zip(self.ids, wrenches):
            self.fext[i] = pin.Force(w)

    @property
    def theirs(self) -> tuple:
        return self.p, self.d, self.Q[0], self.V[0], self.A[0]


@pytest.fixture(scope="module", params=["panda", "solo12"])
def r(request) -> Both:
    return Both(request.param)


def check(found, expected, tolerance: float = 1e-11) -> None:
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() < tolerance * max(1.0, np.abs(expected).max())


def test_efforts(r):
    p, d, q, v, a = r.theirs
    check(r.m.inverse_dynamics(r.q, r.v, r.a, r.external), pin.rnea(p, d, q, v, a, r.fext)[r.in_v])
    check(r.m.bias(r.q, r.v), pin.nonLinearEffects(p, d, q, v)[r.in_v])
    check(r.m.gravity_torque(r.q), pin.computeGeneralizedGravity(p, d, q)[r.in_v])
    check(r.m.gravity_torque(r.q, r.external), pin.computeStaticTorque(p, d, q, r.fext)[r.in_v])
    check(r.m.coriolis_matrix(r.q, r.v) @ r.v, pin.computeCoriolisMatrix(p, d, q, v)[r.square] @ r.v)


def test_mass_matrix(r):
    p, d, q, _, _ = r.theirs
    M = pin.crba(p, d, q)
    check(r.m.mass_matrix(r.q), (np.triu(M) + np.triu(M, 1).T)[r.square])
    W = pin.computeMinverse(p, d, q)
    check(r.m.mass_matrix_inverse(r.q), (np.triu(W) + np.triu(W, 1).T)[r.square], 1e-9)


def test_accelerations(r):
    p, d, q, v, _ = r.theirs
    check(r.m.forward_dynamics(r.q, r.v, r.tau, r.external), pin.aba(p, d, q, v, r.T[0], r.fext)[r.in_v], 1e-9)


def test_derivatives(r):
    p, d, q, v, a = r.theirs
    pin.computeRNEADerivatives(p, d, q, v, a, r.fext)
    by_q, by_v, _ = r.m.inverse_dynamics_derivatives(r.q, r.v, r.a, r.external)
    check(by_q, d.dtau_dq[r.square])
    check(by_v, d.dtau_dv[r.square])
    pin.computeABADerivatives(p, d, q, v, r.T[0], r.fext)
    of_accelerations = d.ddq_dq.copy(), d.ddq_dv.copy(), np.triu(d.Minv) + np.triu(d.Minv, 1).T
    for found, expected in zip(r.m.forward_dynamics_derivatives(r.q, r.v, r.tau, r.external), of_accelerations):
        check(found, expected[r.square], 1e-9)
    check(r.m.stiffness(r.q), pin.computeGeneralizedGravityDerivatives(p, d, q)[r.square])


def test_frames(r):
    p, d, q, v, a = r.theirs
    pin.forwardKinematics(p, d, q, v, a)
    pin.computeJointJacobiansTimeVariation(p, d, q, v)
    pin.updateFramePlacements(p, d)
    for name in r.links:
        i = p.getFrameId(name)
        check(r.m.frame_pose(r.q, name), d.oMf[i].homogeneous)
        for there, where in WHERE:
            check(r.m.frame_velocity(r.q, r.v, name, **where), pin.getFrameVelocity(p, d, i, there).vector)
            for kind, function in (("spatial", pin.getFrameAcceleration), ("classical", pin.getFrameClassicalAcceleration)):
                if kind == "spatial" or there != WORLD:
                    check(r.m.frame_acceleration(r.q, r.v, r.a, name, kind=kind, **where), function(p, d, i, there).vector)
            check(r.m.jacobian(r.q, name, **where), pin.getFrameJacobian(p, d, i, there)[:, r.in_v])
            if there != ALIGNED:
                check(r.m.jacobian_rate(r.q, r.v, name, **where), pin.getFrameJacobianTimeVariation(p, d, i, there)[:, r.in_v])


def test_whole_body(r):
    p, d, q, v, a = r.theirs
    check(r.m.center_of_mass(r.q), pin.centerOfMass(p, d, q, v, a))
    check(r.m.center_of_mass_velocity(r.q, r.v), d.vcom[0])
    check(r.m.center_of_mass_acceleration(r.q, r.v, r.a), d.acom[0])
    check(r.m.center_of_mass_jacobian(r.q), pin.jacobianCenterOfMass(p, d, q)[:, r.in_v])
    check(r.m.centroidal_momentum_matrix(r.q), pin.ccrba(p, d, q, v)[:, r.in_v])
    check(r.m.centroidal_momentum(r.q, r.v), d.hg.vector)
    pin.computeCentroidalMomentumTimeVariation(p, d, q, v, a)
    check(r.m.centroidal_momentum_rate(r.q, r.v, r.a), d.dhg.vector)


def test_derivatives_of_motions(r):
    p, d, q, v, a = r.theirs
    pin.computeForwardKinematicsDerivatives(p, d, q, v, a)
    pin.updateFramePlacements(p, d)
    for name in r.links:
        i = p.getFrameId(name)
        for there, where in WHERE[:2]:
            by_q, by_v = pin.getFrameVelocityDerivatives(p, d, i, there)
            for found, expected in zip(r.m.frame_velocity_derivatives(r.q, r.v, name, **where), (by_q, by_v)):
                check(found, expected[:, r.in_v])
            expected = pin.getFrameAccelerationDerivatives(p, d, i, there)[-3:]
            for found, of_theirs in zip(r.m.frame_acceleration_derivatives(r.q, r.v, r.a, name, **where), expected):
                check(found, of_theirs[:, r.in_v])


def test_derivatives_of_momentum(r):
    p, d, q, v, a = r.theirs
    of_momentum, *of_rate = (x[:, r.in_v] for x in pin.computeCentroidalDynamicsDerivatives(p, d, q, v, a))
    check(r.m.centroidal_momentum_derivatives(r.q, r.v)[0], of_momentum)
    for found, expected in zip(r.m.centroidal_momentum_rate_derivatives(r.q, r.v, r.a), of_rate):
        check(found, expected)


def test_regressors(r):
    p, d, q, v, a = r.theirs
    in_joints = np.array(r.ids) - 1
    of_efforts = pin.computeJointTorqueRegressor(p, d, q, v, a).reshape(p.nv, -1, 10)
    check(r.m.inverse_dynamics_regressor(r.q, r.v, r.a, links=r.children), of_efforts[r.in_v][:, in_joints])
    kinetic, potential = r.m.energy_regressor(r.q, r.v, links=r.children)
    check(kinetic, pin.computeKineticEnergyRegressor(p, d, q, v).reshape(-1, 10)[in_joints])
    check(potential, pin.computePotentialEnergyRegressor(p, d, q).reshape(-1, 10)[in_joints])
    at_rest = pin.computeJointTorqueRegressor(p, d, q, 0 * v, 0 * a).reshape(p.nv, -1, 10)
    check(r.m.gravity_torque_regressor(r.q, links=r.children), at_rest[r.in_v][:, in_joints])


def test_energies(r):
    p, d, q, v, _ = r.theirs
    kinetic, potential = r.m.energy(r.q, r.v)
    check(kinetic, pin.computeKineticEnergy(p, d, q, v))
    other = r.m.energy(r.Q[1][r.in_q], r.v)[1]  # links on the ground have no weight there
    check(potential - other, pin.computePotentialEnergy(p, d, q) - pin.computePotentialEnergy(p, d, r.Q[1]))


def test_manifold(r):
    p, _, q, v, _ = r.theirs
    dv, q1 = 0.3 * v, r.Q[1]
    check(r.m.integrate(r.q, 0.3 * r.v), pin.integrate(p, q, dv)[r.in_q])
    check(r.m.difference(r.q, q1[r.in_q]), pin.difference(p, q, q1)[r.in_v])
    check(r.m.interpolate(r.q, q1[r.in_q], 0.3), pin.interpolate(p, q, q1, 0.3)[r.in_q])
    for found, expected in zip(r.m.integrate_jacobians(r.q, 0.3 * r.v), pin.dIntegrate(p, q, dv)):
        check(found, expected[r.square])
    for found, expected in zip(r.m.difference_jacobians(r.q, q1[r.in_q]), pin.dDifference(p, q, q1)):
        check(found, expected[r.square])


def test_operational_space(r):
    """J M⁻¹ Jᵀ from theirs."""
    p, d, q, _, _ = r.theirs
    name = r.links[-1]
    J = pin.computeFrameJacobian(p, d, q, p.getFrameId(name), LOCAL)
    W = pin.computeMinverse(p, d, q)
    check(r.m.operational_space_inertia_inverse(r.q, [name]), J @ (np.triu(W) + np.triu(W, 1).T) @ J.T, 1e-9)
