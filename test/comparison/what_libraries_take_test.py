"""What other libraries make of files and bodies, without them: documents of URDF and SDF, spheres for impossible tensors, sentences, and what counts as close."""

from xml.etree import ElementTree

import numpy as np
import pytest

import ksl
from ksl.comparison.bodies import about_centroid, pseudo_inertia
from ksl.comparison.body_changes import CHANGES
from ksl.comparison.differences import TOLERANCE, close
from ksl.comparison.file_rules import GENERAL, RULES, rule
from ksl.comparison.other_robot import NotLoaded
from ksl.comparison.urdf_text import of_one_model, on_floating_joint, without


def test_a_robot_floats_on_a_link_whose_name_is_free():
    m = (
        ksl.Builder("two")
        .add_link("ground", 1.0, (0, 0, 0), np.eye(3))
        .add_link("ground_")
        .add_joint("weld", "fixed", "ground", "ground_")
        .build(floating_base=True)
    )
    robot = on_floating_joint(ElementTree.fromstring('<robot name="two"><link name="ground"/></robot>'), m)
    assert [link.get("name") for link in robot.iterfind("link")] == ["ground", "ground__"]
    joint = robot.find("joint")
    assert (joint.get("name"), joint.get("type"), joint.find("parent").get("link"), joint.find("child").get("link")) == (
        m.joints[0].name,
        "floating",
        "ground__",
        "ground",
    )


def test_one_model_of_a_world_is_left():
    left = of_one_model(b'<sdf><world><model name="a"/><model name="b"/></world><model name="b"/></sdf>', "a")
    assert [model.get("name") for model in left.iter("model")] == ["a"]


def test_xml_that_python_refuses_is_not_loaded():
    for call in (lambda text: without(text, "link", "visual"), lambda text: of_one_model(text, "a")):
        with pytest.raises(NotLoaded, match="Python's reader of XML refuses it: unbound prefix"):
            call(b"<robot><gazebo:controller/></robot>")


def test_a_sphere_has_the_density_of_water():
    """2/5 m r², with 4/3 π r³ of 1000 kg/m³; it has 1 kg where there is no mass, and then a tensor is one about the origin."""
    (sphere,) = (change for said, change in CHANGES.items() if "sphere" in said)
    for mass in (0.0, 0.1, 1.0, 7.0):
        given = pseudo_inertia(mass, np.array([0.1, 0.2, 0.3]), np.diag([5.0, 0.1, 0.1]))
        np.testing.assert_allclose(about_centroid(given), np.diag([5.0, 0.1, 0.1]), rtol=1e-12, atol=1e-15)
        P, became = sphere(given), mass or 1.0
        radius = np.sqrt(about_centroid(P)[0, 0] / (0.4 * became))
        np.testing.assert_allclose([P[3, 3], 4 / 3 * np.pi * radius**3 * 1000], became, rtol=1e-12)
        np.testing.assert_allclose(P[:3, 3], given[:3, 3])


def test_a_sentence_of_the_library_comes_before_the_general_one():
    assert rule("mujoco", "masses") == RULES["mujoco", "masses"] != rule("another", "masses") == GENERAL["masses"]
    assert rule("another", "friction").startswith("physics of joints are off in KSL")


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_close_is_a_share_of_the_scale(scale):
    assert close(np.array([scale * TOLERANCE * 0.99]), np.zeros(1), scale) and not close(np.array([scale * TOLERANCE * 1.01]), np.zeros(1), scale)
