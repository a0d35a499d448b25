"""C calls that are not generated, against Python: sections of links, the layout of tree-sparse matrices; and what calls warn of."""

import ctypes
import os
import sys
from ctypes import POINTER, byref, c_bool, c_char, c_char_p, c_double, c_int, c_void_p
from pathlib import Path

import numpy as np
import pytest
from random_states import random_states

import ksl

sys.path.insert(0, str(Path(__file__).parents[1] / "laws"))
from section_test import linkage

ROBOTS = Path(__file__).resolve().parents[2] / "examples/robots"


class Section(ctypes.Structure):
    _fields_ = [
        ("link", c_int), ("point", c_double * 3), ("normal", c_double * 3), ("share", c_int), ("fraction", c_double), ("inertia", c_double * 10),
        ("beyond_n", c_int), ("beyond", POINTER(c_int)), ("axes", c_int), ("order", c_int),
    ]  # fmt: skip


class External(ctypes.Structure):
    _fields_ = [("n", c_int), ("link", POINTER(c_int)), ("wrench", c_void_p), ("axes", c_int)]


class Options(ctypes.Structure):
    _fields_ = [("floating_base", c_bool), ("other", c_char * 63), ("physics_of_joints", c_bool * 7), ("force_elements", c_bool), ("rest", c_char * 64)]


class InC:
    """A model, and the same in C."""

    def __init__(self, floating: bool, file: Path = ROBOTS / "panda.urdf", springs: bool = False) -> None:
        path = os.environ.get("KSL_LIBRARY")
        assert path, "KSL_LIBRARY names the library that make test builds"
        self.of = ctypes.CDLL(path)
        for name in ("ksl_error_message", "ksl_warning_message"):
            getattr(self.of, name).restype = c_char_p
        self.of.ksl_section.restype, self.of.ksl_model_options.restype = Section, Options
        self.m = ksl.load(file, floating_base=floating, physics=["force elements"] if springs else [])
        self.model, self.data, options = c_void_p(), c_void_p(), self.of.ksl_model_options()
        options.floating_base, options.force_elements = floating, springs
        assert self.of.ksl_model_load(str(file).encode(), byref(options), byref(self.model)) == 0
        assert self.of.ksl_data_create(self.model, byref(self.data)) == 0

    def message(self) -> str:
        return self.of.ksl_error_message().decode()

    def section_wrench(self, q, v, a, section, external=None, dtype=np.float64, external_axes="link"):
        arrays = [np.ascontiguousarray(x, dtype) for x in (q, v, a)]
        out, kept, given = np.full(6, np.nan, dtype), [], None
        if external:
            links = (c_int * len(external))(*[self.m.link_names.index(n) for n in external])
            kept = [np.ascontiguousarray(np.stack(list(external.values())), dtype)]
            given = byref(External(len(external), links, kept[0].ctypes.data, int(external_axes == "world")))
        call = self.of.ksl_section_wrenchf if dtype == np.float32 else self.of.ksl_section_wrench
        status = call(self.model, self.data, *(c_void_p(x.ctypes.data) for x in arrays), given, byref(section), c_void_p(out.ctypes.data))
        return status, out


@pytest.fixture(params=[False, True], ids=["fixed", "floating"])
def robot(request):
    return InC(request.param)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_sections_are_those_of_python(robot, dtype):
    m, rng = robot.m, np.random.default_rng(4)
    q, v, a = (x[0].astype(dtype) for x in random_states(m, rng, 1))
    external = {name: rng.normal(size=6).astype(dtype) for name in ("panda_link4", "panda_link7", "panda_link1")}
    count = sum(sections_agree(robot, (q, v, a), name, external, rng) for name in m.link_names)
    assert count > 10


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_sections_of_closed_mechanisms_with_springs_are_those_of_python(tmp_path, dtype):
    (tmp_path / "linkage.urdf").write_text(linkage(False, dtype == np.float64, dtype == np.float32).to_urdf())
    robot = InC(False, tmp_path / "linkage.urdf", springs=True)
    m, rng = robot.m, np.random.default_rng(5)
    q = m.close(m.neutral() + 0.1).q
    v = m.consistent_velocity(q, rng.normal(size=m.nv), given=m.drives)
    a = m.consistent_acceleration(q, v, rng.normal(size=m.nv), given=m.drives)
    count = sum(sections_agree(robot, [x.astype(dtype) for x in (q, v, a)], name, {}, rng, 20.0) for name in ["rod", "rocker", "crank"] * 8)
    assert count > 20


def sections_agree(robot, state, name, external, rng, size=1.0):
    """Holds sections of a link in C against Python, where forces have about that size; returns how many carry something."""
    m, dtype, count = robot.m, state[0].dtype, 0
    loops = [x.name for x in m.loops if name in (x.predecessor, x.successor)]
    numbers = [*(j.name for j in m.joints), *m.loop_names]
    for share in ("body", 0.3, (1.5, (0.1, 0.2, 0.3), np.diag([0.5, 0.6, 0.7]) + 0.01)):
        point, normal = rng.normal(size=3) * 0.2, rng.normal(size=3)
        around = [next(j.name for j in m.joints if j.child == name), *(j.name for j in m.joints if j.parent == name), *loops]
        beyond = None if rng.random() < 0.5 else [j for j in around if rng.random() < 0.5]
        axes, order, held = rng.choice(["link", "world"]), rng.choice(["lin_ang", "ang_lin"]), str(rng.choice(["link", "world"]))
        s = robot.of.ksl_section(m.link_names.index(name))
        assert s.beyond_n == -1
        s.point[:], s.normal[:] = point, normal
        if isinstance(share, float):
            s.share, s.fraction = 1, share
        elif isinstance(share, tuple):
            I = share[2]
            s.share, s.inertia[:] = 2, [share[0], *share[1], I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]]
        if beyond is not None:
            s.beyond_n, s.beyond = len(beyond), (c_int * 8)(*map(numbers.index, beyond))
        s.axes, s.order = int(axes == "world"), int(order == "ang_lin")
        expected = m.section_wrench(*state, name, point, normal, share, beyond, external, str(axes), str(order), held)
        status, found = robot.section_wrench(*state, s, external, dtype, held)
        assert status == 0, robot.message()
        assert np.abs(found - expected).max() <= (1e-12 if dtype == np.float64 else 2e-5) * max(size, np.abs(expected).max())
        count += np.abs(expected).max() > 0.1
    return count


def test_sections_that_are_refused(robot):
    m = robot.m
    state = m.neutral(), np.zeros(m.nv), np.zeros(m.nv)
    for change, words in (
        ({"link": 99}, "a link is out of range"),
        ({"normal": (0, 0, 0)}, "normal is zero"),
        ({"point": (0, np.nan, 0)}, "point[1] is not a finite number"),
        ({"share": 3}, "share must be"),
        ({"share": 1, "fraction": 1.5}, "fraction must be between 0 and 1"),
        ({"beyond_n": 1, "beyond": (c_int * 1)(6)}, "which neither carries"),
        ({"beyond_n": 1}, "beyond must not be null"),
        ({"order": 2}, "order must be"),
    ):
        s = robot.of.ksl_section(3)
        for name, value in change.items():
            setattr(s, name, (c_double * 3)(*value) if name in ("normal", "point") else value)
        status, _ = robot.section_wrench(*state, s)
        assert status == 1 and words in robot.message(), (words, robot.message())


def test_layout_of_the_tree(robot):
    m, n = robot.m, robot.of.ksl_model_tree_elements(robot.model)
    rows, columns = (c_int * (m.nv + 1))(), (c_int * n)()
    assert robot.of.ksl_model_tree(robot.model, rows, columns) == 0
    assert list(rows) == list(m.tree_rows) and list(columns) == list(m.tree_columns) and len(m.tree_columns) == n
    assert robot.of.ksl_model_tree(robot.model, None, None) == 0 and robot.of.ksl_model_tree(None, rows, None) == 1


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_quaternion_that_is_normalised_is_warned_of(dtype):
    robot = InC(True)
    suffix = "f" if dtype == np.float32 else ""
    mass_matrix, difference = (getattr(robot.of, f"ksl_{name}{suffix}") for name in ("mass_matrix", "difference"))
    q, M = robot.m.neutral().astype(dtype), np.empty((robot.m.nv, robot.m.nv), dtype)
    pointer = lambda x: c_void_p(x.ctypes.data)
    expected = robot.m.mass_matrix(q)
    for off, status, warns in ((0, 0, False), (5e-7, 0, False), (3e-6, 0, True), (-9.9e-3, 0, True), (0, 0, False), (1.01e-2, 1, False), (-1, 1, False)):
        rough = q.copy()
        rough[3:7] *= 1 + off
        assert mass_matrix(robot.model, robot.data, pointer(rough), pointer(M)) == status
        said = robot.of.ksl_warning_message()
        assert (said is not None) == warns, off
        if warns:
            assert "floating_base has length" in said.decode() and "normalised" in said.decode()
        if status:
            assert "floating_base has length" in robot.message() and "expected a unit quaternion" in robot.message()
        else:
            assert np.abs(M - expected).max() <= (1e-13 if dtype == np.float64 else 1e-5) * np.abs(expected).max()
    rough, dv = q.copy(), np.empty(robot.m.nv, dtype)
    rough[6] = 1 + 1e-3
    for pair in ((rough, q), (q, rough)):
        assert difference(robot.model, robot.data, pointer(pair[0]), pointer(pair[1]), pointer(dv)) == 0
        assert robot.of.ksl_warning_message() is not None, "of either position"


class JointInfo(ctypes.Structure):
    _fields_ = [
        ("kind", c_char_p), ("parent_link", c_int), ("link", c_int), ("q_index", c_int), ("v_index", c_int), ("nq", c_int), ("nv", c_int),
        ("quaternion", c_int), ("axis", c_double * 3), ("axis2", c_double * 3), ("pitch", c_double), ("lower", c_double * 3), ("upper", c_double * 3),
        ("effort", c_double), ("velocity", c_double),
    ]  # fmt: skip


def test_queries_are_those_of_python(robot):
    m, c, info = robot.m, robot.of, JointInfo()
    names = [j.name for j in m.joints]
    index = lambda link: -1 if link is None else m.link_names.index(link)
    for i, j in enumerate(m.joints):
        assert c.ksl_model_joint_info(robot.model, i, byref(info)) == 0
        assert info.kind.decode() == j.kind and (info.parent_link, info.link) == (index(j.parent), index(j.child))
        assert (info.q_index, info.v_index, info.nq, info.nv) == (j.q_index, j.v_index, j.nq, j.nv)
        assert info.quaternion == (-1 if j.quaternion is None else j.quaternion) and tuple(info.axis) == j.axis and info.pitch == j.pitch
        given = [*j.limits, *[(None, None)] * 3][:3]
        assert list(info.lower) == [-np.inf if x is None else x for x, _ in given]
        assert list(info.upper) == [np.inf if x is None else x for _, x in given]
        assert info.effort == (np.inf if j.effort is None else j.effort) and info.velocity == (np.inf if j.velocity is None else j.velocity)
        links = (c_int * len(m.link_names))()
        n = c.ksl_model_subtree_links(robot.model, i, links)
        assert [m.link_names[k] for k in links[:n]] == m.subtree_links(j.name)
    assert c.ksl_model_joint_info(robot.model, len(names), byref(info)) == 1 and c.ksl_model_subtree_links(robot.model, -1, None) == -1
    ten = (c_double * 10)()
    for k, link in enumerate(m.link_names):
        assert c.ksl_model_link_parameters(robot.model, k, ten) == 0 and np.array_equal(ten, m.parameters[k])
        joints = (c_int * len(names))()
        n = c.ksl_model_support(robot.model, k, joints)
        assert [names[i] for i in joints[:n]] == m.support(link) and n == c.ksl_model_support(robot.model, k, None)
