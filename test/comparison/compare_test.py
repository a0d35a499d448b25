"""`ksl.compare` with libraries that are fakes: KSL's own numbers, and one thing that is planted into them."""

import json
import re

import numpy as np
import pytest
from ksl_command import run_ksl
from scipy.spatial.transform import Rotation

import ksl
from ksl.base.rotations import quaternion_of
from ksl.comparison import libraries
from ksl.comparison.bodies import lumped, of_link, pseudo_inertia
from ksl.comparison.body_changes import changed_links
from ksl.comparison.coordinates import same
from ksl.comparison.differences import TOLERANCE, scale_of_matrix
from ksl.comparison.kinematic_reasons import _motion
from ksl.comparison.libraries import Library
from ksl.comparison.other_robot import NotLoaded, OneState, OtherRobot, Place

ARM = """<robot name="arm"><link name="base"/>
  <link name="upper"><inertial><origin xyz="0.1 0.02 0.2"/><mass value="2"/><inertia ixx="0.03" iyy="0.04" izz="0.02" ixy="0.002" iyz="0.001" ixz="0.003"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0 0.1 0.2"/><mass value="1.25"/><inertia ixx="0.02" iyy="0.03" izz="0.02" ixy="0.001" iyz="0.002" ixz="0.003"/></inertial></link>
  <link name="hand"><inertial><origin xyz="0.05 0 0"/><mass value="0.5"/><inertia ixx="0.002" iyy="0.003" izz="0.002" ixy="0.0001" iyz="0" ixz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="9" velocity="9"/><dynamics damping="0.7" friction="0.4"/></joint>
  <joint name="elbow" type="prismatic"><parent link="upper"/><child link="fore"/><origin xyz="0.2 0 0" rpy="1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="9" velocity="9"/></joint>
  <joint name="weld" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0 0 0.4" rpy="0 1 0"/></joint>
</robot>"""
WITH_ARMATURE = """<mujoco model="geared"><worldbody><body name="one"><joint name="first" axis="0 1 0" armature="0.4" damping="0.3"/>
  <inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.1 0.1"/><body name="two" pos="0.3 0 0"><joint name="second" axis="1 0 0" stiffness="2" springref="0.1"/>
  <inertial pos="0 0.1 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></body></worldbody></mujoco>"""


class Same(OtherRobot):
    """Another library that is KSL.  Subclasses plant what differs."""

    library, version = "fake", "1.0"

    def __init__(self, file):
        super().__init__(file)
        self.own = self.planted(file.model)
        self.nv, self.neutral, self.gravity = self.own.nv, self.own.neutral(), np.array(self.own.gravity)

    def planted(self, model):
        return model

    def place(self, joint):
        own = self.own.joint(joint.name)
        return Place(list(range(own.q_index, own.q_index + own.nq)), list(range(own.v_index, own.v_index + own.nv)), same)

    def note(self):
        pass

    def links(self):
        return list(self.model.link_names)

    def bodies(self):
        return lumped(self.own, [self.model.joint(name).child for name in self.model.joint_names])

    def pose(self, pose, link):
        return pose

    def jacobian(self, J, pose):
        return J

    def compute(self, q, v, a, tau, links):
        m = self.own
        poses = {link: self.pose(m.frame_pose(q, f"link:{link}"), link) for link in links}
        jacobians = {link: self.jacobian(m.jacobian(q, f"link:{link}"), m.frame_pose(q, f"link:{link}")) for link in links}
        return OneState(m.inverse_dynamics(q, v, a), m.forward_dynamics(q, v, tau), m.mass_matrix(q), poses, jacobians)


@pytest.fixture
def compared(tmp_path, monkeypatch):
    """The one result of a comparison with a fake."""

    def compared(fake, text=ARM, **options):
        (tmp_path / "robot.xml").write_text(text)
        monkeypatch.setattr(libraries, "LIBRARIES", LIBRARIES)
        monkeypatch.setitem(LIBRARIES, "fake", Library("json", "pip install fake", fake))
        return ksl.compare(tmp_path / "robot.xml", "fake", **options)["fake"]

    LIBRARIES = libraries.LIBRARIES
    return compared


DYNAMICS = ["inverse dynamics", "forward dynamics", "mass matrix"]
ALL = [*DYNAMICS, "positions", "orientations", "Jacobians"]


def planted(change):
    class Planted(Same):
        def planted(self, model):
            return change(model)

    return Planted


def with_link(change, link="fore"):
    """A link's pseudo-inertia is another."""

    def planted_in(model):
        P = change(of_link(model.link(link)))
        I = np.trace(P[:3, :3]) * np.eye(3) - P[:3, :3]
        return model.with_parameters({link: [P[3, 3], *P[:3, 3], I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]]})

    return planted(planted_in)


def test_the_same_numbers_agree(compared):
    found = compared(Same)
    assert (found.status, found.differing, found.reasons, found.version) == (0, [], [], "1.0")
    assert [q.name for q in found.quantities] == ALL and all(q.agrees and max(q.difference, q.relative) < 1e-12 for q in found.quantities)


@pytest.mark.parametrize("physics", [["damping"], ["friction"], ["damping", "friction"]], ids=" and ".join)
def test_physics_that_only_the_other_library_applies(compared, physics):
    found = compared(planted(lambda m: m.with_physics(physics)))
    assert {r.topic for r in found.reasons} == set(physics) and found.differing == DYNAMICS[:2] and found.status == 1
    assert all(
        r.explains == ("inverse dynamics", "forward dynamics") and "shoulder" in r.text and "KSL where physics= names it" in r.text for r in found.reasons
    )


def test_physics_that_only_ksl_applies(compared):
    found = compared(planted(lambda m: m.with_physics(None)), physics="damping")
    assert [r.topic for r in found.reasons] == ["damping"] and "KSL applies it (physics), fake doesn't" in found.reasons[0].text


def test_a_library_that_ignores_armature(compared):
    pytest.importorskip("mujoco")
    assert compared(Same, WITH_ARMATURE, physics="armature").status == 0
    found = compared(planted(lambda m: m.with_physics(None)), WITH_ARMATURE, physics="armature")
    assert [r.topic for r in found.reasons] == ["armature"] and found.differing == DYNAMICS and found.unexplained == []
    found = compared(planted(lambda m: m.with_physics("all")), WITH_ARMATURE)
    assert {r.topic for r in found.reasons} == {"armature", "damping", "spring"} and found.unexplained == []
    assert next(r for r in found.reasons if r.topic == "armature").explains[0] == "mass matrix"


def test_a_library_that_does_all_otherwise(compared):
    pytest.importorskip("mujoco")
    found = compared(
        planted(lambda m: m.with_physics("all").with_gravity((0, 0, -9))), WITH_ARMATURE.replace('damping="0.3"', 'damping="0.3" frictionloss="0.2"')
    )
    assert {r.topic for r in found.reasons} == {"armature", "damping", "friction", "spring", "gravity"} and found.unexplained == []


@pytest.mark.parametrize("gravity", [(0, 0, 0), (0, 0, 9.81), (0, -9.81, 0), (0, 0, -9.80665)], ids=str)
def test_another_gravity(compared, gravity):
    found = compared(planted(lambda m: m.with_gravity(gravity)))
    assert [r.topic for r in found.reasons] == ["gravity"] and found.differing == DYNAMICS[:2] and found.unexplained == []
    assert "(0, 0, -9.81) in KSL" in found.reasons[0].text


MASSES = {
    "its mass and tensor are dropped": np.zeros_like,
    "a point mass": lambda P: pseudo_inertia(P[3, 3], P[:3, 3] / P[3, 3], np.zeros((3, 3))),
    "products of inertia have the other sign": lambda P: of_central(P, lambda I: 2 * np.diag(np.diag(I)) - I),
    "products of inertia are dropped": lambda P: of_central(P, lambda I: np.diag(np.diag(I))),
    "moments of inertia are made equal": lambda P: of_central(P, lambda I: np.trace(I) / 3 * np.eye(3)),
    "the mass is at the link's origin": lambda P: pseudo_inertia(P[3, 3], np.zeros(3), central(P)),
    "solid sphere of 1000 kg/m³": lambda P: of_central(P, lambda I: 0.4 * P[3, 3] * np.cbrt(3 * P[3, 3] / (4e3 * np.pi)) ** 2 * np.eye(3)),
    "1.95 kg there, 1.75 kg in KSL": lambda P: P + np.diag([0, 0, 0, 0.2]),
    "same principal moments about other axes": lambda P: of_central(P, lambda I: I[::-1, ::-1]),
}


def central(P):
    S = P[:3, :3] - np.outer(P[:3, 3], P[:3, 3]) / P[3, 3]
    return np.trace(S) * np.eye(3) - S


def of_central(P, change):
    return pseudo_inertia(P[3, 3], P[:3, 3] / P[3, 3], change(central(P)))


@pytest.mark.parametrize("said", MASSES)
def test_masses_that_the_other_library_has_otherwise(compared, said):
    text = (
        ARM.replace('name="hand"><inertial>', 'name="hand"><visual/><!--').replace("</inertial></link>\n  <joint", "--></link>\n  <joint")
        if "principal" in said
        else ARM
    )
    found = compared(with_link(MASSES[said]), text)
    assert [r.topic for r in found.reasons] == ["masses"], found
    assert "fore: " in found.reasons[0].text and said in found.reasons[0].text
    assert found.unexplained == [] and found.status == 1


def test_links_that_are_welded_to_others_are_named(compared):
    """One of a body's, or all of them."""
    found = compared(with_link(np.zeros_like, "hand"))
    assert found.reasons[0].text.startswith("hand: its mass and tensor are dropped")
    m = ksl.load_string(ARM)
    assert changed_links(m, {"fore": np.zeros((4, 4))}) == "fore, hand: its mass and tensor are dropped"


@pytest.mark.parametrize(("mass", "size"), [(1e4, 0.3), (1e-4, 0.3), (2.0, 100.0), (2.0, 1e-3)])
def test_masses_are_others_beyond_a_share_of_their_own(mass, size):
    """Of the mass, of the largest second moment, and between them of the root of their product; a mass that is within it is not said to be another."""
    axes = np.diag([3.0, 4.0, 5.0]) * mass * size**2
    m = ksl.Builder("one").add_link("w").add_link("b", mass, (size, 0, 0), axes).add_joint("j", "revolute", "w", "b", axis=(0, 0, 1)).build()
    P = of_link(m.link("b"))
    scale = np.sqrt(np.outer(*2 * [[np.abs(P[:3, :3]).max()] * 3 + [mass]]))
    for i, j in ((0, 0), (0, 1), (1, 3), (3, 3)):
        step = np.zeros((4, 4))
        step[i, j] = step[j, i] = TOLERANCE * scale[i, j]
        within, beyond = (changed_links(m, {"b": P + factor * step}) for factor in (0.98, 1.02))
        assert within == "" and beyond and ("kg in KSL" in beyond) == (i == 3), (i, j)
    for factor, said in ((0.5, "the same principal moments about other axes"), (2, "another tensor or centroid")):
        turned = pseudo_inertia(mass * (1 + 0.5 * TOLERANCE), np.array([size, 0, 0]), axes[::-1, ::-1] * (1 + factor * TOLERANCE))
        assert changed_links(m, {"b": turned}) == f"b: {said}"


def test_links_that_are_named_are_few():
    b = ksl.Builder("chain").add_link("l0")
    for i in range(1, 8):
        b.add_link(f"l{i}", 1.0, inertia=np.eye(3)).add_joint(f"j{i}", "revolute", f"l{i - 1}", f"l{i}", axis=(0, 0, 1))
    said = ["l1, l2, l3, l4, l5: its mass and tensor are dropped", "l1, l2, l3, l4, l5 and 2 more: its mass and tensor are dropped"]
    assert [changed_links(b.build(), {f"l{i}": np.zeros((4, 4)) for i in range(1, n)}) for n in (6, 8)] == said


class AngularFirst(Same):
    def jacobian(self, J, pose):
        return np.roll(J, 3, axis=0)


class Mixed(Same):
    def jacobian(self, J, pose):
        return np.kron(np.eye(2), pose[:3, :3]) @ J


class AtWorldOrigin(Same):
    def jacobian(self, J, pose):
        linear, angular = pose[:3, :3] @ J[:3], pose[:3, :3] @ J[3:]
        return np.concatenate([angular, linear + np.cross(pose[:3, 3], angular.T).T])


class Transposed(Same):
    def pose(self, pose, link):
        changed = pose.copy()
        changed[:3, :3] = pose[:3, :3].T
        return changed


class Opposite(Same):
    def compute(self, *given):
        one = super().compute(*given)
        return one._replace(efforts=-one.efforts)


class Permuted(Same):
    """Its results are of joints in another order than it says, and rounded."""

    def compute(self, *given):
        one = super().compute(*given)
        return one._replace(efforts=one.efforts[::-1] * (1 + 5e-9), mass_matrix=one.mass_matrix[::-1, ::-1])


class OtherQuaternion(Same):
    def compute(self, q, *given):
        q = q.copy()
        q[3:7] = q[[4, 5, 6, 3]]
        return super().compute(q, *given)


class Weightless(Same):
    """It says that it has the file's gravity, and computes without."""

    def planted(self, model):
        return model.with_gravity((0, 0, 0))

    def __init__(self, file):
        super().__init__(file)
        self.gravity = np.array(self.model.gravity)


class Noisy(Same):
    def compute(self, *given):
        one = super().compute(*given)
        return one._replace(efforts=one.efforts + np.sin(1e3 * one.efforts))


@pytest.mark.parametrize(
    ("fake", "topics", "text", "differing"),
    [
        (AngularFirst, ["order"], "angular first", ["Jacobians"]),
        (Mixed, ["frame"], "in world axes;", ["Jacobians"]),
        (AtWorldOrigin, ["order", "frame"], "in world axes and about the world's origin", ["Jacobians"]),
        (Transposed, ["frame"], "transposes", ["orientations"]),
        (Opposite, ["sign"], "opposite sign", ["inverse dynamics"]),
        (Permuted, ["order"], "in another order", ["inverse dynamics", "mass matrix"]),
        (Weightless, ["gravity"], "the numbers are those of no gravity", ["inverse dynamics", "forward dynamics"]),
    ],
)
def test_other_conventions(compared, fake, topics, text, differing):
    found = compared(fake)
    assert [r.topic for r in found.reasons] == topics and text in found.reasons[-1].text
    assert found.differing == differing and found.unexplained == [] and found.status == 1
    assert all(q.difference == q.relative for q in found.quantities if q.name == "orientations"), "rotations have no unit"


def test_another_order_of_quaternions(compared):
    found = compared(
        OtherQuaternion,
        ARM.replace('<link name="base"/>', ARM[ARM.index('<link name="upper"') : ARM.index('  <link name="fore"')].replace("upper", "base")),
        floating_base=True,
    )
    assert {r.topic for r in found.reasons} == {"quaternion"} and found.unexplained == [], found
    assert found.differing == ["inverse dynamics", "forward dynamics", "positions", "orientations"]


def moved(text, **change):
    class Moved(Same):
        def planted(self, model):
            return ksl.load_string(text, mimic="independent")

    return Moved


@pytest.mark.parametrize(
    ("was", "becomes", "said", "explained"),
    [
        (
            'xyz="0.2 0 0" rpy="1 0 0"',
            'xyz="0.2 0.1 0" rpy="1 0 0"',
            "apart by (0, 0.05403, -0.08415) m in the link's axes, at every position: elbow (link fore)",
            True,
        ),
        ('xyz="0 0 0.4" rpy="0 1 0"', 'xyz="0 0 0.4" rpy="0 0.5 0"', "apart by 0.5 rad in the link's axes, at every position: weld (link hand)", True),
        ('axis xyz="0 0 1"', 'axis xyz="0 0 -1"', "the axis points the other way: shoulder (link upper)", True),
        ('axis xyz="0 1 0"', 'axis xyz="1 0 0"', "not constant: another axis, or another number of the joint: elbow (link fore)", False),
    ],
)
def test_joints_where_the_libraries_part(compared, was, becomes, said, explained):
    assert was in ARM
    found = compared(moved(ARM.replace(was, becomes)))
    places = [r for r in found.reasons if r.topic == "joint placement"]
    assert len(places) == 1 and said in places[0].text
    assert found.status == (1 if explained else 2) and (found.unexplained == []) == explained


@pytest.mark.parametrize("angle", [0.0, 2e-9, 1e-3, 2.5, np.pi])
def test_angles_between_frames_are_to_the_last_digit(angle):
    rng = np.random.default_rng(2)
    for _ in range(100):
        X, k = ksl.Pose.from_rpy((0.1, 0.2, 0.3), rng.normal(size=3)).matrix, rng.normal(size=3)
        turn = np.vstack([np.column_stack([Rotation.from_rotvec(angle * k / np.linalg.norm(k)).as_matrix(), [0, 0.1, 0]]), [0, 0, 0, 1]])
        assert _motion(np.linalg.solve(X, X @ turn)) == (f"{angle:.4g} rad and " if angle else "") + "(0, 0.1, 0) m"


def test_robots_of_a_centimetre(compared):
    """Lengths and masses are shares of its own, not of a metre or a kilogram."""
    small = re.sub(r'origin xyz="([^"]*)"', lambda found: f'origin xyz="{" ".join(repr(0.01 * float(x)) for x in found[1].split())}"', ARM).replace(
        '"-1" upper="1"', '"0" upper="0.01"'
    )
    found = compared(moved(small.replace('xyz="0.002 0.0 0.0"', 'xyz="0.002 2e-9 0.0"')), small)
    assert [(r.topic, "elbow (link fore)" in r.text) for r in found.reasons if r.topic != "poses"] == [("joint placement", True)]

    class Rounded(Same):
        def jacobian(self, J, pose):
            return J + 5e-7

    large = ARM.replace('xyz="0.2 0 0" rpy', 'xyz="200 0 0" rpy')
    assert [compared(Rounded, text).differing for text in (large, ARM)] == [[], ["Jacobians"]]
    np.testing.assert_allclose(scale_of_matrix(np.array([[[4e-8, 1e-9], [1e-9, 9e-8]]])), [[4e-8, 6e-8], [6e-8, 9e-8]])


def test_what_nothing_explains_is_said(compared):
    found = compared(Noisy)
    assert (found.status, found.reasons, found.unexplained) == (2, [], ["inverse dynamics"])
    assert found.quantities[0].where.startswith(("shoulder, state", "elbow, state")) and found.quantities[0].unit in ("N m", "N")


@pytest.mark.parametrize(("light", "said"), [(1e-9, True), (1.0, False)])
def test_accelerations_that_rounding_leaves_open(compared, light, said):
    """A link without inertia to speak of between joints about one axis: M = ((l + 1, 1), (1, 1)), whose inverse has 1 / l.  The last digit of M is then 1e-7 of an acceleration."""
    link = '<link name="{0}"><inertial><mass value="1"/><inertia ixx="{1}" iyy="{1}" izz="{1}" ixy="0" iyz="0" ixz="0"/></inertial></link>'.format
    joint = '<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/><axis xyz="0 0 1"/></joint>'.format
    text = f'<robot name="two"><link name="base"/>{link("between", light)}{link("end", 1)}{joint("first", "base", "between")}{joint("second", "between", "end")}</robot>'

    class Rounded(Same):
        def compute(self, q, v, a, tau, links):
            found = super().compute(q, v, a, tau, links)
            M = found.mass_matrix.copy()
            M[1, 1] = np.nextafter(M[1, 1], 2)
            return found._replace(accelerations=np.linalg.solve(M, tau))

    found = compared(Rounded, text)
    assert found.status == 0 and found.differing == []
    notes = [note.text for note in found.conventions if note.topic == "conditioning"]
    assert (len(notes) == 1 and re.search("rounding alone leaves the acceleration of (first|second) open by", notes[0])) if said else notes == []
    assert (found.quantities[1].difference > 1e-8) == said
    if said:  # |M⁻¹| |M| has four times 2 / l, and of the largest acceleration the sum of both is one or two
        assert 1 <= float(notes[0].split("open by ")[1].split()[0]) / (16 * np.finfo(float).eps / light) <= 2

    class Other(Same):
        def compute(self, q, v, a, tau, links):
            found = super().compute(q, v, a, tau, links)
            return found._replace(accelerations=found.accelerations * (1 + 1e-4))

    assert compared(Other, text).unexplained == ["forward dynamics"]


def test_a_robot_that_the_other_library_refuses(compared):
    def refuse(file):
        raise NotLoaded("it refuses the file: \x1b[2J\u202e" + "x" * 9000)

    found = compared(refuse)
    assert found.status == 2 and "\x1b" not in found.failed and "\u202e" not in found.failed and len(found.failed) < 4200

    class Lacking(Same):
        def place(self, joint):
            return None if joint.name == "elbow" else super().place(joint)

    assert compared(Lacking).failed == "it has no such joint as elbow (prismatic): its coordinates are others"

    class Failing(Same):
        def compute(self, *given):
            raise RuntimeError("no solution")

    assert compared(Failing).failed == "it has no result: no solution"


def test_links_without_frames_and_joints_without_mass(compared):
    class Fused(Same):
        def links(self):
            return ["base", "upper"]

    found = compared(Fused)
    assert found.status == 0 and found.not_compared == ["poses and Jacobians of links that it has no frames of: fore, hand"]
    without = re.sub(r"<inertial>(?:(?!</inertial>).)*</inertial></link>\n  <joint", "</link>\n  <joint", ARM).replace(
        '<mass value="1.25"/>', '<mass value="0"/>'
    )
    without = re.sub(r'(<mass value="0"/>)<inertia [^>]*>', r'\1<inertia ixx="0" iyy="0" izz="0" ixy="0" iyz="0" ixz="0"/>', without)

    class NoAccelerations(Same):
        def compute(self, q, v, a, tau, links):
            m = self.own
            poses, jacobians = ({link: f(q, f"link:{link}") for link in links} for f in (m.frame_pose, m.jacobian))
            return OneState(m.inverse_dynamics(q, v, a), np.full(m.nv, np.nan), m.mass_matrix(q), poses, jacobians)

    with pytest.warns(ksl.DescriptionWarning):
        found = compared(NoAccelerations, without)
    assert found.status == 0 and "forward dynamics: a joint moves no mass" in found.not_compared[0]


def test_a_robot_without_joints_that_move(tmp_path):
    (tmp_path / "rock.urdf").write_text(
        "<robot name='rock'><link name='a'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' iyz='0' ixz='0'/></inertial></link></robot>"
    )
    with pytest.raises(ksl.DescriptionError, match="rock.urdf: no joint moves, and there is nothing to compare; floating_base"):
        ksl.compare(tmp_path / "rock.urdf")


def test_files_that_are_no_xml(tmp_path):
    """USD has angles in its paths, and its binary form has any byte."""
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdPhysics

    for name in ("r.usda", "r.usdc"):
        stage = Usd.Stage.CreateNew(str(tmp_path / name))
        base, arm = (UsdGeom.Xform.Define(stage, f"/r/{link}").GetPrim() for link in ("base", "arm"))
        UsdPhysics.RigidBodyAPI.Apply(base), UsdPhysics.RigidBodyAPI.Apply(arm), UsdPhysics.MassAPI.Apply(arm).CreateMassAttr(1.0)
        joint = UsdPhysics.RevoluteJoint.Define(stage, "/r/turn")
        joint.CreateBody0Rel().SetTargets([base.GetPath()]), joint.CreateBody1Rel().SetTargets([arm.GetPath()])
        stage.GetRootLayer().Save()
        with pytest.raises(ksl.DescriptionError, match=f"{name}: is no XML that can be read; compared are URDF, SDF and MJCF"):
            ksl.compare(tmp_path / name)


def test_xacro(tmp_path, compared):
    pytest.importorskip("xacro")
    text = ARM.replace('<robot name="arm">', '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm"><xacro:arg name="damping" default="0"/>').replace(
        'damping="0.7"', 'damping="$(arg damping)"'
    )
    (tmp_path / "arm.xacro").write_text(text)
    compared(Same)  # registers it
    libraries.LIBRARIES["fake"] = Library("json", "", planted(lambda m: m.with_physics("damping")))
    assert ksl.compare(tmp_path / "arm.xacro", "fake", xacro={})["fake"].status == 0
    found = ksl.compare(tmp_path / "arm.xacro", "fake", xacro={"damping": 2})
    assert found["fake"].status == 1 and found.file == f"{tmp_path / 'arm.xacro'} (expanded by xacro)"


def test_libraries_that_are_missing_are_named_with_the_command_that_brings_them(tmp_path, monkeypatch):
    (tmp_path / "arm.urdf").write_text(ARM)
    monkeypatch.setitem(libraries.LIBRARIES, "drake", libraries.LIBRARIES["drake"]._replace(package="not_there_at_all"))
    found = ksl.compare(tmp_path / "arm.urdf", "drake")
    assert (found.status, found.libraries, found.missing) == (2, (), {"drake": "pip install drake"})
    with pytest.raises(KeyError, match="no results of 'drake'; there are those of none"):
        found["drake"]
    done = run_ksl("compare", str(tmp_path / "arm.urdf"), "--with", "drake")
    assert done.returncode == 2 and "drake: not installed; pip install drake" in done.stdout

    def broken(file):
        raise ImportError("libboost.so.1: cannot open")

    monkeypatch.setitem(libraries.LIBRARIES, "drake", Library("json", "pip install drake", broken))
    assert ksl.compare(tmp_path / "arm.urdf", "drake")["drake"].failed == "its package is installed and can't be imported: libboost.so.1: cannot open"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"libraries": "drakee"}, "no library named 'drakee'; did you mean 'drake'"),
        ({"libraries": []}, "libraries is empty"),
        ({"states": 0}, "states=0; expected a whole number, 1 to 1000"),
        ({"states": True}, "states=True"),
        ({"states": 1001}, "states=1001"),
        ({"seed": -1}, "seed=-1"),
        ({"seed": 2**63}, "seed=9223372036854775808; expected a whole number, 0 to 9223372036854775807"),
        ({"physics": "dampng"}, "dampng"),
    ],
)
def test_arguments(tmp_path, options, said):
    (tmp_path / "arm.urdf").write_text(ARM)
    with pytest.raises(ValueError, match=re.escape(said)):
        ksl.compare(tmp_path / "arm.urdf", **options)
    words = {"libraries": "--with", "states": "--states", "seed": "--seed", "physics": "--physics"}
    (name, value), *_ = options.items()
    if isinstance(value, (str, int)) and not isinstance(value, bool):
        done = run_ksl("compare", str(tmp_path / "arm.urdf"), words[name], str(value))
        assert done.returncode == 2 and done.stderr.startswith("ksl: ") and str(value) in done.stderr


def test_the_command_prints_reasons_and_json(tmp_path, monkeypatch):
    (tmp_path / "arm.urdf").write_text(ARM.replace("shoulder", "shoul\u202eder"), encoding="utf-8")
    monkeypatch.setitem(libraries.LIBRARIES, "mujoco", Library("json", "", planted(lambda m: m.with_physics("damping"))))
    done = run_ksl("compare", str(tmp_path / "arm.urdf"), "--with", "mujoco", "--states", "3")
    assert done.returncode == 1 and "\u202e" not in done.stdout and "\\u202e" in done.stdout
    assert "mujoco 1.0: inverse dynamics, forward dynamics differ, and each difference is explained" in done.stdout.replace("fake", "mujoco")
    assert "damping (inverse dynamics, forward dynamics): fake applies it (shoul\\u202eder)" in done.stdout
    done = run_ksl("compare", str(tmp_path / "arm.urdf"), "--with", "mujoco", "--json")
    found = json.loads(done.stdout)
    assert found["status"] == found["libraries"][0]["status"] == 1 and found["libraries"][0]["reasons"][0]["topic"] == "damping"


def test_cost_of_bodies_is_linear_in_welded_links():
    """Chains of welds are walked once."""
    from growth import assert_linear, work
    from ksl.comparison.bodies import welded

    def chain(n):
        b = ksl.Builder("chain").add_link("l0", 1.0)
        for i in range(1, n):
            b.add_link(f"l{i}", 1.0).add_joint(f"j{i}", "revolute" if i == 1 else "fixed", f"l{i - 1}", f"l{i}", **({"axis": (0, 0, 1)} if i == 1 else {}))
        return b.build()

    assert_linear(lambda n: work(lambda m=chain(n): welded(m)), 50)


def test_every_coordinate_form_keeps_power():
    """τ' · v' = τ · v for all forms, and T's rate is its derivative along v."""
    from ksl.comparison import coordinates as c

    rng = np.random.default_rng(4)
    X = ksl.Pose.from_rpy((0.1, 0.2, 0.3), (0.4, 0.5, 0.6)).matrix
    m = ksl.Builder("free").add_link("w").add_link("b", 1.0).add_joint("f", "floating", "w", "b").build()
    p = ksl.Builder("plane").add_link("w").add_link("b", 1.0).add_joint("f", "planar", "w", "b", axis=(0, 0, 1)).build()
    for model, forms in ((m, (c.free(X), c.free_in_world(X), c.free_linear_in_world(X))), (p, (c.same, c.cosine_and_sine, c.planar_in_parent))):
        q, v = model.random(rng, 3), rng.normal(size=(3, model.nv))
        for form in forms:
            h = 1e-6
            ahead, behind = (form(model.integrate(q, s * h * v), v) for s in (1, -1))
            derivative = np.einsum("nij,nj->ni", ahead.T - behind.T, v) / (2 * h)
            np.testing.assert_allclose(form(q, v).rate, derivative, atol=1e-8)
            assert form(q, v).T.shape == (3, model.nv, model.nv)
    q = np.array([[0.1, 0.2, 0.7]])
    np.testing.assert_allclose(c.cosine_and_sine(q, q).q, [[0.1, 0.2, np.cos(0.7), np.sin(0.7)]])
    np.testing.assert_allclose(c.cosine_and_sine(q[:, 2:], q[:, 2:]).q, [[np.cos(0.7), np.sin(0.7)]])
    q = m.random(rng, 1)
    pose = X @ m.frame_pose(q[0], "link:b")
    x, y, z, w = quaternion_of(pose[:3, :3])
    for form, order in ((c.free(X), [x, y, z, w]), (c.free_linear_in_world(X), [w, x, y, z])):
        found = form(q, np.zeros((1, 6))).q[0]
        np.testing.assert_allclose(found[:3], pose[:3, 3])
        np.testing.assert_allclose(found[3:] * np.sign(found[3] * order[0]), order, atol=1e-12)
    np.testing.assert_allclose(c.free_in_world(X)(q, np.zeros((1, 6))).q[0][4:], pose[:3, 3])
