"""Thresholds of the rules, each just below and just above, by numbers that the file is written to have."""

import math

import numpy as np
import pytest
from files import hinge, link, more, stl
from loop_files import planar, spatial
from symmetry_test import limbs

import ksl

NEAR = 2e-3
"""Share by which numbers are below and above: less than a tenth of any threshold, and more than its rounding."""
SLIDE = '<limit lower="{}" upper="0" effort="9" velocity="2"/>'


def solid(size, mass=3.0, second=(1e-3, 2e-3, 3e-3), centroid=(0, 0, 0), middle=(0, 0, 0), moments=None, shape="", joint="revolute"):
    """The arm with a link whose box, mass, centroid and second moments about that, m² for each kg, are given; or moments, kg m²."""
    if moments is None:
        moments = mass * (sum(second) - np.array(second, dtype=float))
    written = [x if isinstance(x, str) else repr(float(x)) for x in moments]
    size = "{!r} {!r} {!r}".format(*(float(x) for x in np.broadcast_to(size, 3)))
    shape = shape or '<collision><origin xyz="{} {} {}"/><geometry><box size="{}"/></geometry></collision>'.format(*middle, size)
    return more(
        f'<link name="x"><inertial><origin xyz="{" ".join(repr(float(x)) for x in centroid)}"/><mass value="{float(mass)!r}"/>'
        f'<inertia ixx="{written[0]}" iyy="{written[1]}" izz="{written[2]}" ixy="0" ixz="0" iyz="0"/></inertial>{shape}</link>',
        hinge("j", "fore", "x", kind=joint),
    )


def bare(*moments, mass=1.0):
    """A link without geometry."""
    return solid(0, mass, moments=moments, shape=" ")


def bar(along, away=0.2, sideways=1e-3, size=0.4):
    """A bar along z, whose centroid is off the origin; `along` is what its second moment along z is to be about the origin."""
    return solid((0.1, 0.1, size), 3.0, (sideways, 1e-3, along), (0, 0, away))


def wheel(moments, radius=0.1, length=0.04, turn=math.pi / 2):
    """A cylinder that is turned about x by an angle, and moments about the link's axes."""
    return solid(
        0,
        1.0,
        moments=moments,
        shape=f'<collision><origin rpy="{turn!r} 0 0"/><geometry><cylinder radius="{radius}" length="{length!r}"/></geometry></collision>',
    )


def drawn(scale):
    """A mesh of 0.1 m at a scale, which turns without end about the z axis."""
    return solid(
        0, 1.0, moments=(3e-3, 3e-3, 5e-3), shape=f'<visual><geometry><mesh filename="cube.stl" scale="{scale}"/></geometry></visual>', joint="continuous"
    )


def limited(kind, lower):
    return more(link("x"), hinge("j", "fore", "x", kind=kind).replace('lower="-1" upper="1"', f'lower="{lower!r}" upper="0"'))


def copies(*masses, moments=(0.011, 0.012, 0.013)):
    numbers = 'ixx="{}" iyy="{}" izz="{}"'.format(*moments)
    return more(*(part for k, mass in enumerate(masses) for part in (link(f"c{k}", mass, moments=numbers), hinge(f"j{k}", "fore", f"c{k}"))))


def welded(mass, moments=(1e-6, 1e-6, 9e-6)):
    """A part whose inertia no body has, on the fore arm, of 1 kg and at most 0.0084 kg m², beside a frame that has neither."""
    return more(
        '<link name="frame"/>',
        hinge("f", "fore", "frame", kind="fixed"),
        link("x", mass, moments='ixx="{}" iyy="{}" izz="{}"'.format(*moments)),
        hinge("j", "fore", "x", kind="fixed"),
    )


def units(ratio):
    """Moments of a part whose radius of gyration is that of half a cube's diagonal, one and a half times, times the root of the ratio."""
    return solid(0.2, 3.0, np.array([0.3, 0.3, 0.4]) * ratio * 0.75**2 * 0.12)


DIAGONAL, UNIFORM, ALLOWED = math.sqrt(3), 0.4**2 / 12, lambda c: 2.25 * (0.1 + 0.05 * math.sqrt(3) - c) * (0.1 + 0.05 * math.sqrt(3) + c)
LENGTH = ksl.load_string(spatial()).mobility(np.zeros(4)).length
CAUSE = lambda words: lambda f: words in f.cause
WARNING = lambda f: f.severity == "warning"

# rule, file by a number, threshold, whether the rule is broken above it; what must be true of the finding where it is broken at both
THRESHOLDS = {
    # a body may reach beyond its geometry by a quarter of the diagonal, and 10 mm at least
    "a margin": ("centroid-outside", lambda x: solid(0.4, centroid=(0, 0, x)), 0.2 + 0.1 * DIAGONAL, True),
    "a margin below": ("centroid-outside", lambda x: solid(0.4, centroid=(-x, 0, 0)), 0.2 + 0.1 * DIAGONAL, True),
    "the least margin": ("centroid-outside", lambda x: solid(0.02, 0.1, (1e-5, 2e-5, 3e-5), (0, x, 0)), 0.02, True),
    "a marker": ("centroid-outside", lambda x: solid(x, 0.01, centroid=(1, 0, 0)), 0.011, True),
    "more than such a part weighs": ("centroid-outside", lambda x: solid(0.1, x, centroid=(1, 0, 0)), 6000 * 0.12**3, False),
    "more than a sheet weighs": ("centroid-outside", lambda x: solid((0.1, 0.1, 1e-4), x, centroid=(1, 0, 0)), 6000 * 0.12**2 * 0.021, False),
    "a light part that is welded to a heavy one": ("centroid-outside", lambda x: solid(0.1, x, (1e-4, 2e-4, 3e-4), (1, 0, 0), joint="fixed"), 0.05, True),
    "millimetres": ("centroid-outside", lambda x: solid(0.1, centroid=(0, 0, x)), 50 * 0.1 + 0.05 + 0.025 * DIAGONAL, CAUSE("is in millimetres.")),
    "a thousandth that lies within": ("centroid-outside", lambda x: solid(0.1, centroid=(0, 0, -x)), 1000 * (0.05 + 0.025 * DIAGONAL), lambda f: not f.acceptable),
    "a thousandth that lies within, above": ("centroid-outside", lambda x: solid(0.1, centroid=(x, 0, 0)), 1000 * (0.05 + 0.025 * DIAGONAL), lambda f: not f.acceptable),
    "a sign": ("centroid-outside", lambda x: solid(0.1, centroid=(0, -x, 0), middle=(0, 1, 0)), 1.05 + 0.025 * DIAGONAL, lambda f: "The sign of y" not in f.cause),
    # moments about the origin: far from it, more than twice those of a uniform bar, and then those of an ordinary part
    "a centroid near the origin": ("inertia-about-origin", lambda x: bar(x * x + 0.02, x), 0.1, True),
    "not much for a bar": ("inertia-about-origin", lambda x: bar(x, 0.12), 2 * UNIFORM, True),
    "less than a part has": ("inertia-about-origin", bar, 0.2**2 + 0.15 * UNIFORM, True),
    "more than a part has": ("inertia-about-origin", bar, 0.2**2 + 2 * UNIFORM, False),
    "little of a wide part": ("inertia-about-origin", lambda x: bar(0.03, 0.12, x), 10 * 0.12**2 - 0.03, False),
    "what no body has": ("inertia-about-origin", lambda x: bar(0.2**2 + UNIFORM, sideways=-x), (UNIFORM + 1e-3) * (1 - 1 / 1.001) / 2, False),
    "a negative moment": ("inertia-about-origin", lambda x: solid((0.1, 0.1, 0.4), 3.0, (-x, 0, 0.04 + UNIFORM), (0, 0, 0.2)), 1e-6 * UNIFORM, False),
    # units
    "a hundred times": ("inertia-units", units, 100, True),
    "of a wire": ("inertia-units", lambda x: solid((0.012, 1e-4, 1e-4), 3.0, (x, x / 2, x / 2)), 0.005, True),
    "too small": ("inertia-units", lambda x: solid(0.3, 3.0, (x * x / 2, x * x / 4, x * x / 4)), 1e-3, False),
    "too small to tell": ("inertia-units", lambda x: solid(x, 1e-3, (5e-13, 3e-13, 2e-13)), 0.02, True),
    **{
        f"{unit} from {low:g}": ("inertia-units", units, low, CAUSE(unit))
        for unit, low in (("kg cm²", 200), ("kg mm²", 2e4), ("g cm²", 2e5), ("g mm²", 2e7))
    },
    **{
        f"{unit} up to {high:g}": ("inertia-units", units, high, lambda f, unit=unit: unit not in f.cause.replace("k" + unit, ""))
        for unit, high in (("g m²", 1e3), ("kg cm²", 1e4), ("kg mm²", 1e6), ("g cm²", 1e7), ("g mm²", 1e9))
    },
    "one unit": ("inertia-units", units, 200, lambda f: not f.acceptable),
    # the room within which the mass can lie: half the box and its margin, once and a half
    **{f"room around {c}": ("inertia-too-large", lambda x, c=c: solid(0.2, 3.0, (0.01, 0.01, x), (0, 0, c)), ALLOWED(c), True) for c in (0, 0.04, -0.04)},
    # density
    "heavier than any metal": ("mass-units", lambda x: solid(0.1, x), 25000 * 0.12**3, True),
    "a heavy sheet": ("mass-units", lambda x: solid((0.1, 0.1, 1e-4), x), 25000 * 0.12**2 * 0.021, True),
    "lighter than air": ("mass-units", lambda x: solid(0.2, x), 0.1 * 0.2**3, False),
    "a light part that is small": ("mass-units", lambda x: solid((0.1, 0.1, x), 1e-6), 0.1, True),
    # moments that no body has
    "a moment below zero": ("inertia-not-positive", lambda x: bare(1, 1.1, -x), 1.1e-6, True),
    "tiny moments below zero": ("inertia-not-positive", lambda x: bare(1e-13, 1e-13, -x, mass=2), 2e-12, True),
    "the nearest to it": ("inertia-not-positive", lambda x: bare(1, 1.1, -x), 0.11, lambda f: not f.fixable),
    "an excess": ("inertia-triangle", lambda x: bare(1, 1.1, 2.1 + x), 2.1e-6, True),
    "a tiny excess": ("inertia-triangle", lambda x: bare(1e-13, 1.1e-13, 2.1e-13 + x, mass=2), 2e-12, True),
    "the nearest to that": ("inertia-triangle", lambda x: bare(1, 1.1, 2.1 + x), 0.21 / 0.9, lambda f: not f.fixable),
    "digits of a plate": ("inertia-triangle", lambda x: bare("0.100", "0.110", 0.21 + x), 1.5e-3, lambda f: not WARNING(f)),
    "few digits of a plate": ("inertia-triangle", lambda x: bare("0.10", "0.11", 0.21 + x), 0.0021 / 0.99, lambda f: not WARNING(f)),
    "a light part that is welded": ("inertia-triangle", welded, 0.05, lambda f: not WARNING(f)),
    "a small part that is welded": ("inertia-triangle", lambda x: welded(1e-3, (x / 9, x / 9, x)), 0.05 * 0.0084, lambda f: not WARNING(f)),
    "a point": ("inertia-zero", lambda x: bare(x, x, x, mass=2), 2e-12, False),
    "masses of copies": ("inertia-placeholder", lambda x: copies(1, 0.9, x), 1.35, True),
    # axes and limits
    "a long axis": ("axis-not-unit", lambda x: more(link("x"), hinge("j", "fore", "x").replace("0 0 1", f"0 {1 + x!r} 0")), 1e-3, True),
    "a short axis": ("axis-not-unit", lambda x: more(link("x"), hinge("j", "fore", "x").replace("0 0 1", f"0 0 {x - 1!r}")), 1e-3, True),
    "two turns": ("limit-units", lambda x: limited("revolute", -x), 4 * math.pi * 1.001, True),
    "a long travel": ("limit-units", lambda x: limited("prismatic", -x), 20.02, True),
    "angles without bounds": ("limit-units", lambda x: limited("revolute", -x), 1000, False),
    "travels without bounds": ("limit-units", lambda x: limited("prismatic", -x), 1000, False),
    # round shapes: two moments or extents that agree to a fiftieth, and a third that differs by a tenth
    "a disc": ("inertia-axis", lambda x: wheel((x, x, 0.01)), 0.009, False),
    "a disc that is not round": ("inertia-axis", lambda x: wheel((x, 0.005, 0.01)), 0.0052, False),
    "a bar": ("inertia-axis", lambda x: wheel((0.01, 0.01, x), 0.02, 0.4), 0.009, False),
    "a bar that is not round": ("inertia-axis", lambda x: wheel((0.01, x, 0.001), 0.02, 0.4), 0.0098, True),
    "the longest disc": ("inertia-axis", lambda x: wheel((0.005, 0.005, 0.01), 0.1, x), 0.1 * DIAGONAL, False),
    "the shortest bar": ("inertia-axis", lambda x: wheel((0.01, 0.01, 0.005), 0.1, x), 0.1 * DIAGONAL, True),
    "half a right angle": ("inertia-axis", lambda x: wheel((0.005, 0.005, 0.01), turn=x), math.pi / 4, True),
    "the direction of an axis": ("inertia-axis", lambda x: wheel((0.005, 0.005, 0.01), turn=math.pi / 2 - x), math.acos(0.999), lambda f: not f.found.endswith(" about y")),
    # a wheel turns about its centroid: m c² is at most a tenth of the trace
    "a wheel of another axis": ("inertia-axis", lambda x: solid(0, 2.0, moments=(0.005, 0.01, 0.005), centroid=(0, x, 9), shape=" ", joint="continuous"), math.sqrt(0.1 * 0.02 / 2), False),
    # meshes, and both sides
    "a large mesh": ("mesh-units", lambda x: drawn(f"1 {x} 1"), 500, True),
    "two sizes of a mesh": (
        "mesh-scales",
        lambda x: more('<link name="x">' + "".join(f'<visual><geometry><mesh filename="cube.stl" scale="1 {y} 0.5"/></geometry></visual>' for y in (2, x)) + "</link>", hinge("j", "fore", "x", kind="fixed")),
        60,
        True,
    ),
    "a screw": ("symmetry-mass", lambda x: limbs(0.02, 0.02 + x, 0.02), 0.01, True),
    "a twentieth": ("symmetry-mass", lambda x: limbs(2, x, 1), 3 / 0.95 - 1, True),
    # loops: the crank of 0.2 m and the rod of 0.5 m
    "parallel axes": ("loop-frames", lambda x: planar(f"{x!r} 0 0"), 1e-12, True),
    "axes of few digits": ("loop-frames", lambda x: planar(f"{x!r} 0 0"), 1e-4, lambda f: "few digits" not in f.cause and "°" in f.found and "spherical" not in f.repair),
    "a place of few digits": ("loop-open-at-zero", lambda x: spatial(ball=f"0 {0.3 + x!r} 0"), 1e-4 * LENGTH, lambda f: "few digits" not in f.cause),
}  # fmt: skip


@pytest.fixture(autouse=True)
def cube(tmp_path):
    (tmp_path / "cube.stl").write_bytes(stl())


@pytest.mark.parametrize("what", THRESHOLDS)
def test_a_rule_is_broken_on_one_side_of_its_threshold(check, what):
    rule, file, threshold, broken = THRESHOLDS[what]
    below, above = ([f for f in check(file(threshold * (1 + side * NEAR))) if f.rule == rule] for side in (-1, 1))
    if broken in (True, False):
        assert (len(below), len(above)) == ((0, 1) if broken else (1, 0)), (below, above)
    else:
        assert (len(below), len(above)) == (1, 1) and not broken(below[0]) and broken(above[0]), (below, above)


@pytest.mark.parametrize(
    ("masses", "moments", "told"),
    [
        ((1, 1), (0.1, 0.2, 0.2), 0), ((1, 2), (0.1, 0.2, 0.2), 0), ((1, 1, 2), (0.1, 0.2, 0.2), 1), ((0.7,), (0.1, 0.1, 0.1), 1), ((0.7,), (0.01, 0.01, 0.01), 0),
        ((1,), (0.01, 0.01, 0.01), 1), ((0.7, 0.7), (0.01, 0.01, 0.01), 0), ((0.7, 0.7, 0.7), (0.01, 0.01, 0.01), 1), ((0.7, 0.7, 0.7), (0.02, 0.02, 0.02), 0),
        ((0.7, 0.7, 0.7), (0.01, 0.01, 0.0101), 0), ((0.7, 0.7, 0.7), (0.0101, 0.01, 0.01), 0),
    ],
)  # fmt: skip
def test_what_is_a_placeholder(check, masses, moments, told):
    """From three links on; of one link with 1 kg, or with 0.1 kg m² or more; and powers of ten, all equal."""
    assert check(copies(*masses, moments=moments)).rules.get("inertia-placeholder", 0) == told


@pytest.mark.parametrize(
    ("shape", "told"),
    [('sphere radius="0.1"', 0), ('box size="0.1 0.1 0.1"', 0), ('box size="0.1 0.1 0.3"', 1), ('cylinder radius="0.1" length="0.2"', 1), ("", 1)],
)
def test_moments_of_balls_and_cubes_are_equal(check, shape, told):
    drawn = f"<collision><geometry><{shape}/></geometry></collision>" if shape else ""
    part = link("x", 0.7, drawn, 'ixx="0.1" iyy="0.1" izz="0.1"')
    assert check(more(part, hinge("j", "fore", "x"))).rules.get("inertia-placeholder", 0) == told
