"""The reader of URDF against those of Pinocchio and MuJoCo: the same poses of all links and the same mass matrix, for every file of
example-robot-data that they read.

REFUSED, DIFFERENT and UNREADABLE list the exceptions with their reasons.  An entry that is no longer needed fails, too."""

import importlib.util
import re
import warnings

import numpy as np
import pytest
from robots import all_robots

import ksl

FILES = all_robots()
TOLERANCE = 1e-12

# file: why KSL refuses it
REFUSED: dict[str, str] = {"ur_description/urdf/ur3.urdf": "a robot without links: its text is a comment"}
# (library, file): why its numbers are others
DIFFERENT: dict[tuple[str, str], str] = {}
# (library, file): why that library refuses it
UNREADABLE: dict[tuple[str, str], str] = {
    **dict.fromkeys(
        [("mujoco", name) for name in (
            "alex_description/urdf/alex_psyonic_hands.urdf",
            "allegro_hand_description/urdf/allegro_left_hand.urdf",
            "allegro_hand_description/urdf/allegro_right_hand.urdf",
            "anymal_c_simple_description/urdf/anymal.urdf",
            "pr2_description/urdf/pr2.urdf",
            "romeo_description/urdf/romeo_small.urdf",
        )],
        "an inertia whose principal moments break the triangle inequality; KSL warns of it",
    ),
    **dict.fromkeys(
        [("mujoco", name) for name in (
            "anymal_b_simple_description/robots/anymal-kinova.urdf",
            "anymal_b_simple_description/robots/anymal.urdf",
            "b1_description/urdf/b1-z1.urdf",
            "b1_description/urdf/b1.urdf",
            "finger_edu_description/robots/finger_edu.urdf",
            "go1_description/urdf/go1.urdf",
            "hyq_description/robots/hyq_no_sensors.urdf",
            "icub_description/robots/icub.urdf",
            "icub_description/robots/icub_reduced.urdf",
            "romeo_description/urdf/romeo_laas_small.urdf",
            "tiago_description/robots/tiago.urdf",
            "tiago_description/robots/tiago_dual.urdf",
            "tiago_description/robots/tiago_no_hand.urdf",
        )],
        "an inertia that is not positive definite, of a link without size or mass; KSL warns where no body can have it",
    ),
    **dict.fromkeys(
        [("mujoco", name) for name in (
            "human_description/robots/human.urdf",
            "romeo_description/urdf/romeo.urdf",
        )],
        "a moving link without mass, which KSL allows",
    ),
}  # fmt: skip


def model_of(name: str) -> ksl.Model | None:
    """Mimic joints move on their own and no loops are closed, as in the other libraries."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)
        try:
            return ksl.load(FILES[name], mimic="independent", masses="optional", loops="cut")
        except ksl.DescriptionError:
            return None


def position(m: ksl.Model) -> np.ndarray:
    """Angles and lengths of ordinary size; planar and floating joints don't occur in these files."""
    return np.sin(1.0 + 2.3 * np.arange(m.nq))


def disagreement(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.abs(found - expected).max(initial=0) / max(1.0, np.abs(expected).max(initial=0)))


def with_pinocchio(name: str, m: ksl.Model) -> float:
    """The largest disagreement, relative to the largest number of each quantity."""
    import pinocchio as pin

    p = pin.buildModelFromUrdf(str(FILES[name]))
    q = position(m)
    theirs, in_v = pin.neutral(p), np.zeros(m.nv, int)
    for joint in (m.joint(n) for n in m.joint_names):
        of = p.joints[p.getJointId(joint.name)]
        angle, in_v[joint.v_index] = q[joint.q_index], of.idx_v
        theirs[of.idx_q : of.idx_q + of.nq] = (np.cos(angle), np.sin(angle)) if of.nq == 2 else (angle,)
    d = p.createData()
    M = pin.crba(p, d, theirs)
    worst = disagreement(m.mass_matrix(q), (np.triu(M) + np.triu(M, 1).T)[np.ix_(in_v, in_v)])
    pin.framesForwardKinematics(p, d, theirs)
    for link in m.link_names:
        if p.existBodyName(link):
            worst = max(worst, disagreement(m.frame_pose(q, f"link:{link}"), d.oMf[p.getBodyId(link)].homogeneous))
    return worst


def with_mujoco(name: str, m: ksl.Model) -> float:
    """The same with MuJoCo.  It gets no meshes, which are not in every package, and keeps all links where it can."""
    import mujoco

    mujoco.set_mju_user_warning(lambda said: None)  # otherwise it writes a log file into the current folder
    text = re.sub(r"<(visual|collision)\b.*?</\1>|<(visual|collision)\b[^>]*/>", "", FILES[name].read_text(), flags=re.S)
    text = re.sub(r"<transmission\b.*?</transmission>|<gazebo\b.*?</gazebo>|<gazebo\b[^>]*/>", "", text, flags=re.S)

    def read(fuse: str):
        options = f'<mujoco><compiler fusestatic="{fuse}" discardvisual="false" inertiafromgeom="false"/></mujoco>'
        return mujoco.MjModel.from_xml_string(re.sub(r"(<robot\b[^>]*>)", r"\1" + options, text, count=1))

    try:
        theirs = read("false")
    except ValueError:  # an inertia that no body can have is taken as that of a part of its parent
        theirs = read("true")
    d = mujoco.MjData(theirs)
    q = position(m)
    in_v = np.zeros(m.nv, int)
    for joint in (m.joint(n) for n in m.joint_names):
        j = mujoco.mj_name2id(theirs, mujoco.mjtObj.mjOBJ_JOINT, joint.name)
        assert j >= 0, joint.name
        d.qpos[theirs.jnt_qposadr[j]], in_v[joint.v_index] = q[joint.q_index], theirs.jnt_dofadr[j]
    mujoco.mj_forward(theirs, d)
    M = np.zeros((theirs.nv, theirs.nv))
    mujoco.mj_fullM(theirs, d, M)
    worst = disagreement(m.mass_matrix(q), M[np.ix_(in_v, in_v)])
    for link in m.link_names:
        b = mujoco.mj_name2id(theirs, mujoco.mjtObj.mjOBJ_BODY, link)
        if b > 0:
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = d.xmat[b].reshape(3, 3), d.xpos[b]
            worst = max(worst, disagreement(m.frame_pose(q, f"link:{link}"), pose))
    return worst


LIBRARIES = {name: compare for name, compare in (("pinocchio", with_pinocchio), ("mujoco", with_mujoco)) if importlib.util.find_spec(name)}


@pytest.mark.parametrize("library", ["pinocchio", "mujoco"])
def test_the_library_is_there(library):
    """So that one skipped test, instead of a hundred, says which library was not compared with.  `make trust` installs both."""
    if library not in LIBRARIES:
        pytest.skip(f"{library} is not installed")
    assert any((library, name) not in UNREADABLE for name in FILES)


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("name", FILES)
def test_the_same_mechanism(name, library):
    m = model_of(name)
    if m is None:
        assert name in REFUSED, "KSL refuses a file, and no reason is given"
        return
    assert name not in REFUSED
    try:
        worst = LIBRARIES[library](name, m)
    except (ValueError, RuntimeError, IndexError) as error:  # what those libraries raise for a file that they refuse
        assert (library, name) in UNREADABLE, f"{library} refuses it, and no reason is given: {error}"
        return
    assert (library, name) not in UNREADABLE
    if (library, name) in DIFFERENT:
        assert worst > TOLERANCE, "no longer different: take it out of the table"
    else:
        assert worst <= TOLERANCE


def test_every_entry_names_a_file():
    assert {*REFUSED, *(name for _, name in DIFFERENT), *(name for _, name in UNREADABLE)} <= set(FILES)


@pytest.mark.skipif("mujoco" not in LIBRARIES, reason="MuJoCo is not installed")
def test_a_wrong_reader_is_seen():
    """A planted fault: the origin of one joint is 1e-9 m off."""
    name = "panda_description/urdf/panda.urdf"
    text = FILES[name].read_text()
    wrong = re.sub(r'xyz="0 -0.316 0"', 'xyz="0 -0.316000001 0"', text, count=1)
    assert wrong != text
    assert with_mujoco(name, ksl.load_string(wrong, mimic="independent")) > TOLERANCE


if __name__ == "__main__":  # the disagreements of all files
    for name in FILES:
        model = model_of(name)
        for library, compare in LIBRARIES.items():
            try:
                print(f"{library}\t{name}\t{compare(name, model):.1e}" if model else f"{library}\t{name}\trefused here", flush=True)
            except Exception as error:
                print(f"{library}\t{name}\tERROR {type(error).__name__} {str(error)[:150]!r}", flush=True)
