"""Models from text in memory."""

import pickle
import warnings

import ksl
import numpy as np
import pytest


@pytest.fixture(scope="module")
def path(examples):
    return examples / "robots/ur5.urdf"


def test_the_same_model_as_from_the_file(path):
    m = ksl.load(path)
    for text in (path.read_text(), path.read_bytes(), path.read_text().replace('encoding="utf-8"', "").encode("utf-16")):
        other = ksl.load_string(text)
        assert other.file == "<string>" and other.joints == m.joints and other.links == m.links
    floating = ksl.load_string(path.read_text(), floating_base=True, gravity=(0, 0, -1), payloads={"tool0": (2, (0, 0, 0.1))})
    assert floating.nq == 13 and floating.gravity.tolist() == [0, 0, -1] and floating.mass == pytest.approx(m.mass + 2)


def test_a_pickle_needs_no_file(path):
    m = ksl.load_string(path.read_text())
    other = pickle.loads(pickle.dumps(m))
    q = np.full(6, 0.3)
    assert np.array_equal(other.inverse_dynamics(q, q, q), m.inverse_dynamics(q, q, q))


def test_other_formats():
    sdf = "<sdf version='1.9'><model name='one'><link name='l'><inertial><mass>3</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link></model></sdf>"
    assert ksl.load_string(sdf).mass == 3
    with pytest.raises(ksl.DescriptionError, match='<string>.*no model "two"'):
        ksl.load_string(sdf, model="two")
    pytest.importorskip("mujoco")
    mjcf = "<mujoco><worldbody><body name='p'><joint name='hinge'/><geom size='0.1'/></body></worldbody></mujoco>"
    for text in (mjcf, mjcf.encode()):
        assert ksl.load_string(text).joint_names == ["hinge"]
    with pytest.raises(ksl.DescriptionError, match="<string>: MuJoCo's compiler refuses"):
        ksl.load_string(mjcf.replace("joint", "jiont"))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "<robot name='r'>\n<link name='a'/>\n<joint name='j' type='revolut'/></robot>",
            '<string>:3: joint j: joint type "revolut" is unknown.*did you mean "revolute"',
        ),
        ("<robot name='r'>\n<link", "<string>:2: broken XML"),
        ("robot.urdf", "text 'robot.urdf' holds no XML; .*ksl.load"),
        ("", "holds no XML"),
        (3, "text is int; expected the contents"),
    ],
)
def test_errors_name_the_line(text, sentence):
    with pytest.raises(ValueError, match=sentence):
        ksl.load_string(text)


def test_contents_given_as_a_path(path):
    with pytest.raises(ksl.DescriptionError, match="ksl.load_string"):
        ksl.load(path.read_text())


def test_warnings_point_to_the_call():
    text = "<robot name='r'><link name='a'/><link name='b'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='9' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint></robot>"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ksl.load_string(text)
    assert [w.filename for w in caught] == [__file__]
