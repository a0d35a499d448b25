"""Rules of left and right."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ksl.checks.description.repair import shown
from ksl.checks.description.robot import RobotFile
from ksl.checks.rule import Broken, rule

WORDS = {"l": "r", "lf": "rf", "lh": "rh", "lm": "rm", "lr": "rr", "fl": "fr", "hl": "hr", "rl": "rr", "bl": "br", "ml": "mr"}
"""Words of names that mean the left side, and those of the right: left; left front, hind, middle, rear; front left …"""
LIGHT = 0.01
"""kg.  Differences below it are not reported: a screw."""


def right_of(name: str) -> list[str]:
    """Names that the right counterpart of a link may have: forearm_right of forearm_left, RF_HIP of LF_HIP, RShoulder
    of LShoulder, thighR of thighL."""
    candidates = []
    for left, right in (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT")):
        if left in name:
            candidates.append(name.replace(left, right))
    words = re.split(r"([_\-./ ]+)", name)
    swapped = [_cased(WORDS[word.lower()], word) if word.lower() in WORDS else word for word in words]
    if swapped != words:
        candidates.append("".join(swapped))
    camel = re.sub(r"(^|_)([Ll])(?=[A-Z][a-z])", lambda m: m[1] + ("R" if m[2] == "L" else "r"), name)
    at_end = re.sub(r"(?<=[a-z])L(?=\d*(_|$))", "R", name)
    for other in (camel, at_end):
        if other != name:
            candidates.append(other)
    return candidates


def _cased(word: str, like: str) -> str:
    return word.upper() if like.isupper() else word


def pairs(robot: RobotFile) -> dict[str, str]:
    """{left link: right link}, of all that have a counterpart.

    A link that carries the other one is on no side: the arm of a Motoman robot has the links S, L, U, R, B and T.
    """
    found = {}
    for name in robot.link_of:
        for other in right_of(name):
            if other in robot.link_of and not robot.carries(name, other) and not robot.carries(other, name):
                found[name] = other
                break
    return found


@rule(
    "symmetry-mass",
    "warning",
    condition="Left and right limbs have the same mass, to the share that --symmetry states (5 %).",
    cause="One side was changed and the other was not, or a part was left out on one side.",
    repair="Give both sides the same masses, unless they really differ.",
    whole=True,
)
def symmetry_mass(robot: RobotFile) -> Iterator[Broken]:
    paired = pairs(robot)
    both = set(paired) | set(paired.values())
    for left, right in paired.items():
        above = robot.joint_above.get(left)
        if above is not None and above.parent in both:
            continue  # within a limb that is compared as a whole
        limb = [name for name in robot.subtree(left) if name in paired]
        if not {paired[name] for name in limb} <= set(robot.subtree(right)):
            continue  # names that don't tell limbs apart
        masses = [(robot.link_of[name].mass, robot.link_of[paired[name]].mass, name) for name in limb]
        on_left, on_right = sum(m[0] for m in masses), sum(m[1] for m in masses)
        difference = abs(on_left - on_right)
        larger = max(abs(on_left), abs(on_right))  # a mass that is negative is another rule's
        if difference > LIGHT and difference > robot.symmetry * larger:
            worst = max(masses, key=lambda m: abs(m[0] - m[1]))
            share = difference / larger
            most = f"; most of it {worst[2]}, {shown(worst[0])} kg, and {paired[worst[2]]}, {shown(worst[1])} kg" if len(limb) > 1 else ""
            found = f"limb {left} has {shown(on_left)} kg, {right} has {shown(on_right)} kg: {share:.0%} less{most}"
            yield Broken(found, robot.link_of[worst[2]].line, "link", left, share)
