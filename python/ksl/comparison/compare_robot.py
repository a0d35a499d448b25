"""`ksl.compare`: the same robot file in other libraries, at the same states."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ksl import _core
from ksl.base.errors import ArgumentError, DescriptionError, DescriptionWarning, of_argument, unknown_name
from ksl.base.printable import sentence
from ksl.comparison.differences import JACOBIANS, ORIENTATIONS, POSITIONS, TOLERANCE, pairs, quantity, rounding_of_accelerations, scale_of_coordinates
from ksl.comparison.hypotheses import dynamic_reasons
from ksl.comparison.kinematic_reasons import kinematic_reasons
from ksl.comparison.libraries import LIBRARIES, is_installed
from ksl.comparison.other_robot import File, NotLoaded, Numbers, OtherRobot, States, numbers_of_ksl
from ksl.comparison.results import Comparison, Note, OneLibrary
from ksl.robot_files.loading import load, root_element
from ksl.model.model import Model
from ksl.robot_files.xacro_files import expanded, with_packages

MOST_STATES = 1000
MOST_SAID = 20
"""Warnings of a library that are kept."""


def compare(
    robot: str | os.PathLike[str],
    libraries: Iterable[str] | str | None = None,
    *,
    floating_base: bool = False,
    strict: bool = False,
    model: str | None = None,
    physics: str | Iterable[str] | None = None,
    states: int = 8,
    seed: int = 0,
    xacro: Mapping[str, object] | None = None,
    packages: Mapping[str, str | os.PathLike[str]] | None = None,
) -> Comparison:
    """The same robot file in other libraries: which numbers differ, after which conventions were converted, and why.

    robot: a URDF, SDF or MJCF file, which each library reads by itself.
    libraries: names among "pinocchio", "mujoco" and "drake"; None is all of them.  Those that aren't installed are in `missing` of the result,
    with the command that brings them.
    floating_base, strict, model, physics: as :func:`ksl.load` takes them.  Mimic joints are independent and loops cut in this comparison, as others have them.
    states: how many random states, 1 to 1000; positions within limits, velocities and accelerations of standard deviation 1 rad/s or m/s, and so on.
    seed: of their generator, 0 or more.
    xacro, packages: as :func:`ksl.load` takes them; what xacro makes of the file is compared.

    Compared are efforts for accelerations, accelerations for efforts, mass matrices, poses and Jacobians of all links, in KSL's conventions
    (:doc:`conventions`): numbers agree within 1e-8 of the largest of their kind.  `reasons` are what was tried on KSL's model and gives the other
    library's numbers.  Raises DescriptionError where KSL can't read the file or no joint moves, ValueError for other arguments.  Cost: some milliseconds a
    library, state and 10 links, beside its import.

        found = ksl.compare("robot.urdf", "mujoco")
        print(found.status, found["mujoco"].differing, [r.text for r in found["mujoco"].reasons])
    """
    wanted = _names(libraries)
    _check_count(states, "states", 1, MOST_STATES)
    _check_count(seed, "seed", 0, 2**63 - 1)
    asked = with_packages(xacro, packages)
    if asked is not None:
        made = expanded(os.fspath(robot), asked)
        with TemporaryDirectory() as folder:  # other libraries read files
            path = Path(folder) / "robot.urdf"
            path.write_bytes(made.contents)
            return replace(
                compare(path, libraries, floating_base=floating_base, strict=strict, model=model, physics=physics, states=states, seed=seed), file=made.name
            )
    file, notes, said = _read(robot, floating_base, strict, model, physics)
    for line in said:
        warnings.warn(line, DescriptionWarning, stacklevel=2)
    read = file.model
    if read.nv == 0:  # some libraries crash on such a robot
        raise DescriptionError(f"{read.file}: no joint moves, and there is nothing to compare; floating_base (--floating-base) lets the root float")
    given = _random_states(read, states, seed)
    missing = {name: LIBRARIES[name].command for name in wanted if not is_installed(LIBRARIES[name])}
    found = tuple(_one(name, file, given, notes) for name in wanted if name not in missing)
    return Comparison(str(file.path), read.name, read.nv, states, seed, found, missing)


def _names(libraries: Iterable[str] | str | None) -> list[str]:
    names = list(LIBRARIES) if libraries is None else [libraries] if isinstance(libraries, str) else list(libraries)
    for name in names:
        if name not in LIBRARIES:
            raise of_argument(ArgumentError, "libraries", unknown_name("", "library", name, LIBRARIES))
    if not names:
        raise of_argument(ArgumentError, "libraries", f" is empty; give some of {', '.join(LIBRARIES)}, or None for all")
    return list(dict.fromkeys(names))


def _check_count(x: object, name: str, least: int, most: int) -> None:
    if isinstance(x, bool) or not isinstance(x, (int, np.integer)) or not least <= x <= most:
        raise of_argument(ArgumentError, name, f"; expected a whole number, {least} to {most}", x)


def _read(
    robot: str | os.PathLike[str], floating_base: bool, strict: bool, chosen: str | None, physics: str | Iterable[str] | None
) -> tuple[File, list[Note], tuple[str, ...]]:
    """The file with its model, what KSL does otherwise by default, and its warnings."""
    on = None if physics is None else [physics] if isinstance(physics, str) else list(physics)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DescriptionWarning)  # the caller gives them once
        default = load(robot, floating_base, strict=strict, model=chosen, physics=on)
        model = load(robot, floating_base, "independent", strict, model=chosen, physics=on, loops="cut")
    contents = _core.file_bytes(os.fsencode(model.file))
    root = root_element(contents)
    if root is None:
        raise DescriptionError(
            f"{model.file}: is no XML that can be read; compared are URDF, SDF and MJCF, which other libraries read, too: ksl.load(…).to_urdf(path) writes URDF"
        )
    notes = []
    if default.follower_names:
        notes.append(Note("mimic", f'KSL couples mimic joints to their leaders ({", ".join(default.follower_names[:5])}); compared with mimic="independent"'))
    if default.loops:
        notes.append(Note("loops", f'KSL closes {len(default.loops)} loop{"s" if len(default.loops) > 1 else ""}; compared are the trees, loops="cut"'))
    format_ = {"mujoco": "mjcf", "sdf": "sdf"}.get(root, "urdf")
    return File(os.path.abspath(model.file), contents, format_, model, bool(floating_base), chosen), notes, tuple(default.warnings)


def _random_states(model: Model, count: int, seed: int) -> States:
    """Efforts are those of other random accelerations: of light links they would be enormous otherwise."""
    rng = np.random.default_rng(seed)
    q = model.random(rng, count)
    v, a, other = rng.normal(size=(3, count, model.nv))
    return States(q, v, a, model.inverse_dynamics(q, v, other))


def _one(name: str, file: File, states: States, notes: list[Note]) -> OneLibrary:
    result = OneLibrary(name)
    try:
        other = LIBRARIES[name].load(file)
        other.places()
        other.note()
    except NotLoaded as e:
        result.failed = sentence(str(e))
        return result
    except ImportError as e:
        result.failed = sentence(f"its package is installed and can't be imported: {e}")
        return result
    result.version, result.conventions = other.version, [*notes, *other.conventions]
    result.said = [sentence(line) for line in dict.fromkeys(other.said)][:MOST_SAID]
    try:
        _compare(other, states, result)
    except NotLoaded as e:
        result.failed = sentence(str(e))
    except (ValueError, RuntimeError) as e:
        result.failed = sentence(f"it has no result: {e}")
    return result


def _nearly_singular(model: Model, ksl: Numbers) -> list[Note]:
    """Says which acceleration double precision leaves open, if it does."""
    if ksl.accelerations is None:
        return []
    open_ = rounding_of_accelerations(ksl) / scale_of_coordinates(model, ksl.accelerations)
    state, k = np.unravel_index(int(open_.argmax()), open_.shape)
    if open_[state, k] <= TOLERANCE:
        return []
    joint = next(name for name in model.joint_names if model.joint(name).v_index <= k < model.joint(name).v_index + model.joint(name).nv)
    text = f"the mass matrix is nearly singular at state {state}: rounding alone leaves the acceleration of {joint} open by {open_[state, k]:.1e} of the largest; forward dynamics are compared within that"
    return [Note("conditioning", text)]


def _compare(other: OtherRobot, states: States, result: OneLibrary) -> None:
    numbers = other.numbers(states)
    ksl = numbers_of_ksl(other.model, states, list(numbers.poses))
    result.quantities = [quantity(pair) for pair in pairs(other.model, ksl, numbers)]
    if ksl.accelerations is None:
        result.not_compared.append("forward dynamics: a joint moves no mass, and KSL has no accelerations")
    result.conventions += _nearly_singular(other.model, ksl)
    absent = [link for link in other.model.link_names if link not in numbers.poses]
    if absent:
        result.not_compared.append(f"poses and Jacobians of links that it has no frames of: {', '.join(absent[:10])}{' …' if len(absent) > 10 else ''}")
    differing = result.differing
    of_frames = kinematic_reasons(other, states, ksl, numbers, differing)
    result.reasons = of_frames
    if {POSITIONS, ORIENTATIONS}.isdisjoint(differing) or [r.topic for r in of_frames] in (["quaternion"], ["frame"]):
        result.reasons = of_frames + dynamic_reasons(other, states, numbers, [name for name in differing if name != JACOBIANS])
    elif rest := tuple(name for name in differing if name not in (POSITIONS, ORIENTATIONS)):
        text = f"{', '.join(rest)} follow from poses that differ; what else differs can't be told before these agree"
        result.reasons = [*of_frames, Note("poses", text, rest if all(r.explains for r in of_frames) else ())]
