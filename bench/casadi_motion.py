#!/usr/bin/env python3
"""Functions for CasADi: one call beside the plain function's, and a motion with a bound on a reaction, by Ipopt, beside adam's expressions.

    python bench/casadi_motion.py [ROBOT.urdf]    default: examples/robots/ur5.urdf

Needs casadi, adam-robotics and gcc.  Adam has no reactions: both problems bound the efforts of the joints, and only KSL's bounds a reaction.
Times of Ipopt are whole solutions; how long functions take to make is listed apart.
"""

import sys
import tempfile
import time
from pathlib import Path

import casadi as cs
import numpy as np
from compiled import timed

import ksl

N, STEP = 20, 0.05


def one_call(m: ksl.Model) -> None:
    """From C: the interface's function beside the plain one."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        ksl.generate(m, ["inverse_dynamics"], folder, name="one", abi="casadi")
        declared = "int one_casadi_inverse_dynamics(const double **, double **, long long int *, double *, int);\n"
        flags = ("-O2", "-ffp-contract=off", "-std=gnu99")
        plain = timed(folder, ["one.c"], '#include "one.h"\n', "one_inverse_dynamics(q, v, a, tau)", *flags)
        theirs = timed(folder, ["one_casadi.c"], declared, "one_casadi_inverse_dynamics(arg, res, 0, w, 0)", *flags)
        print(f"inverse dynamics from C: {plain:.0f} ns plain, {theirs:.0f} ns by CasADi's interface: {theirs / plain:.2f} x")


def solved(tau, nq: int, exact: bool, reaction=None) -> str:
    """A motion of least effort from rest to rest."""
    opti = cs.Opti()
    q, v, a = (opti.variable(nq, N + 1) for _ in range(3))
    opti.subject_to(cs.vec(q[:, 1:] - q[:, :-1] - STEP / 2 * (v[:, 1:] + v[:, :-1])) == 0)
    opti.subject_to(cs.vec(v[:, 1:] - v[:, :-1] - STEP / 2 * (a[:, 1:] + a[:, :-1])) == 0)
    start, end = np.linspace(-1, 0.5, nq), np.linspace(-0.4, 0.8, nq)
    for x, k, at in ((q, 0, start), (v, 0, 0), (q, N, end), (v, N, 0)):
        opti.subject_to(x[:, k] == at)
    efforts = [tau(q[:, k], v[:, k], a[:, k]) for k in range(N + 1)]
    opti.subject_to(opti.bounded(-150, cs.vertcat(*efforts), 150))
    if reaction is not None:
        opti.subject_to(cs.vertcat(*(cs.sumsqr(reaction(q[:, k], v[:, k], a[:, k])[3:5]) for k in range(N + 1))) <= 40.0**2)
    opti.minimize(1e-3 * sum(map(cs.sumsqr, efforts)))
    opti.set_initial(q, np.linspace(start, end, N + 1).T)
    options = {"print_level": 0, "sb": "yes", "max_iter": 500} | ({} if exact else {"hessian_approximation": "limited-memory"})
    opti.solver("ipopt", {"print_time": False}, options)
    begin = time.perf_counter()
    found = opti.solve_limited()
    took = time.perf_counter() - begin
    return f"{took:7.2f} s, {found.stats()['iter_count']:4} iterations, cost {found.value(opti.f):.6g} ({found.stats()['return_status']})"


def adams(path: Path, m: ksl.Model) -> cs.Function:
    from adam.casadi import KinDynComputations

    robot = KinDynComputations(str(path), [name for name in m.joint_names if m.joint(name).nv])
    q, v, a = (cs.SX.sym(x, m.nv) for x in "qva")
    base, rest = cs.SX.eye(4), cs.SX.zeros(6)
    tau = robot.mass_matrix_fun()(base, q)[6:, 6:] @ a + robot.bias_force_fun()(base, q, rest, v)[6:]
    return cs.Function("theirs", [q, v, a], [cs.cse(tau)])


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "examples/robots/ur5.urdf"
    m = ksl.load(path).with_gravity((0, 0, -9.80665))  # that of adam
    one_call(m)
    begin = time.perf_counter()
    own = ksl.casadi_function(m, "inverse_dynamics", derivatives=2)
    print(f"made: {time.perf_counter() - begin:.2f} s by ksl", end="")
    begin = time.perf_counter()
    theirs = adams(path, m)
    print(f", {time.perf_counter() - begin:.2f} s by adam")
    given = np.random.default_rng(1).normal(size=(3, m.nv))
    print(f"largest difference of efforts: {np.abs(own(*given) - theirs(*given)).full().max():.1e} N m")
    for exact in (True, False):
        for name, tau in (("ksl", own), ("adam", theirs)):
            print(f"{name:5} {'exact' if exact else 'L-BFGS':7} {solved(tau, m.nv, exact)}", flush=True)
    elbow = [joint for joint in m.joint_names if m.joint(joint).nv][m.nv // 2 - 1]
    print(f"ksl, {elbow}'s bearing bounded: {solved(own, m.nv, True, ksl.casadi_function(m, f'reactions:{elbow}', derivatives=2))}")


if __name__ == "__main__":
    sys.exit(main())
