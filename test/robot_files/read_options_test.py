"""Options of reading are one list: those of ksl.load, of ksl.load_string and of the class that readers are given."""

import inspect
import typing
from dataclasses import FrozenInstanceError, fields

import ksl
import numpy as np
import pytest
from ksl.robot_files.read_options import ReadOptions

OF_LOAD_ALONE = ("xacro", "packages")
ARM = (
    '<robot name="arm"><link name="base"/><link name="tip"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="A" type="continuous"><parent link="base"/><child link="tip"/><axis xyz="0 1 0"/></joint></robot>'
)


@pytest.mark.parametrize("call", [ksl.load, ksl.load_string])
def test_a_call_has_the_options_of_the_class_in_its_order_with_its_defaults_and_hints(call):
    taken = [p for p in list(inspect.signature(call).parameters.values())[1:] if p.name not in OF_LOAD_ALONE]
    of_class = [f for f in fields(ReadOptions) if f.init]
    assert [(p.name, p.default) for p in taken] == [(f.name, f.default) for f in of_class]
    hints, of_fields = typing.get_type_hints(call), typing.get_type_hints(ReadOptions)
    assert all(hints[p.name] == of_fields[p.name] for p in taken)


def test_options_are_checked_once_and_iterators_are_read_once():
    options = ReadOptions(
        physics=(word for word in ("damping", "friction")), gravity=np.array([0, 0, -1.0]), floating_base=np.True_, payloads={"tip": (2, (0, 0, 1))}
    )
    assert options.physics_named == (["damping", "friction"], 0.01)
    assert options.of_core() == (True, False, False, [0.0, 0.0, -1.0], [("tip", 2.0, [0.0, 0.0, 1.0])], False, "", options.physics_named, False)
    assert options.of_core()[0] is True
    assert options.of_builder() == options.of_core()[2:6], "both readers get the same"
    with pytest.raises(FrozenInstanceError):
        options.strict = True
    named = ksl.load_string(ARM, physics=(word for word in ("damping", "friction")))
    assert set(named.physics) == {"damping", "friction"}


@pytest.mark.parametrize(
    "name, value, said",
    [
        ("floating_base", 1, "floating_base=1; expected True or False"),
        ("mimic", "both", "mimic"),
        ("strict", None, "strict=None; expected True or False"),
        ("gravity", (0, 0), "gravity"),
        ("payloads", [1], "payloads is list; expected a mapping"),
        ("masses", "none", "masses"),
        ("physics", 1, "physics=1: expected names"),
        ("friction_width", "wide", "friction_width is 'wide'; expected a number"),
        ("loops", 7, "loops is 7; expected the path of a TOML file"),
    ],
)
def test_a_value_that_no_file_can_be_read_by_is_refused_before_the_file_is_read(name, value, said):
    with pytest.raises(ValueError, match=said):
        ksl.load("there is no such file.urdf", **{name: value})
