"""Files that are no robots, cut short or meant to do harm end in findings or one sentence, never in a traceback."""

import json
import random
from collections.abc import Iterator, MutableMapping

import pytest
from files import ARM, END, changed, hinge, link, more

import ksl
from growth import assert_linear, work
from ksl.base import limits
from ksl.base.errors import DescriptionError
from ksl.checks import file_rules
from ksl.checks.description import tags, write, xml_file
from ksl.checks.run import findings_of_bytes, fix
from ksl_command import run_ksl
from regex_steps import count_patterns


@pytest.mark.parametrize(
    "data, sentence",
    [
        (b"", "is empty"),
        (b"  \n", "is empty"),
        (b"name,mass\narm,3\n", "is no XML file"),
        (bytes(range(256)) * 40, "is no XML file"),
        (b"\x7fELF\x02\x01\x01\x00<robot name='a'/>" + bytes(500), "is no XML file"),
    ],
)
def test_what_is_no_xml_is_one_sentence(check, data, sentence):
    with pytest.raises(DescriptionError, match=sentence) as error:
        check(data)
    assert "\n" not in str(error.value) and "robot.urdf" in str(error.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(DescriptionError, match="is a folder"):
        ksl.check(tmp_path)
    with pytest.raises(DescriptionError, match="No such file"):
        ksl.check(tmp_path / "absent.urdf")


@pytest.mark.parametrize("length", range(0, len(ARM), 61))
def test_a_file_cut_short(check, length):
    if not ARM[:length].strip():
        return
    findings = check(ARM[:length])
    assert findings.errors and "xml-syntax" in findings.rules
    assert all(f.line is None or f.line <= ARM.count("\n") + 1 for f in findings)


def test_what_stands_before_the_break_is_checked(check):
    text = changed(('axis xyz="0 0 1"', 'axis xyz="0 0 0"'))
    assert "axis-zero" in check(text[: text.index("elbow") + 20]).rules


def test_bytes_changed_at_random(check):
    """120 files with 1 to 5 bytes changed: findings or a sentence."""
    rng = random.Random(7)
    for _ in range(120):
        data = bytearray(ARM.encode())
        for _ in range(rng.randint(1, 5)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        try:
            check(bytes(data))
        except DescriptionError as e:
            assert "\n" not in str(e)


def test_values_changed_at_random(check):
    """Numbers, names and types in each other's places."""
    import re

    rng = random.Random(11)
    values = re.findall(r'"[^"]*"', ARM) + ['""', '"nan"', '"-inf"', '"1e999"', '"0x10"', '"1_0"', '"٣"', '"' + "9" * 400 + '"', '"${x}"', '"a b c"']
    places = [m.span() for m in re.finditer(r'"[^"]*"', ARM)][2:]
    for _ in range(120):
        a, b = places[rng.randrange(len(places))]
        check(ARM[:a] + rng.choice(values) + ARM[b:])


def test_entities_are_not_read(check, tmp_path):
    (tmp_path / "secret.txt").write_text("s3cret")
    text = f'<!DOCTYPE robot [<!ENTITY x SYSTEM "file://{tmp_path}/secret.txt"><!ENTITY y "yy">]>\n' + ARM.split("?>")[1].replace(
        "</robot>", "<note>&x;&y;</note></robot>"
    )
    findings = check(text)
    assert "s3cret" not in repr(findings) + str(findings.as_dict())


def test_entities_that_multiply(check):
    levels = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 12))
    text = f'<!DOCTYPE robot [<!ENTITY e0 "ha">{levels}]>\n' + ARM.split("?>")[1].replace('name="arm"', 'name="&e11;"')
    assert check(text).errors


def test_a_huge_attribute_and_deep_nesting(check):
    assert check(changed(('name="fore"', f'name="{"x" * 11_000_000}"'))).errors
    assert check(ARM.replace(END, "<a>" * 100_000 + END)).errors


def test_a_huge_number_of_findings_is_listed_fast(check):
    lost = "".join(f'<link name="l{i}"/>' for i in range(3000))
    assert check(ARM.replace(END, lost + END)).rules["link-unreachable"] == 3000


def test_other_roots(check):
    assert "not-loaded" in check("<html><body/></html>").rules
    assert "not-loaded" in check('<mujoco><worldbody><body name="a"><geom size="x"/></body></worldbody></mujoco>').rules
    assert check("<sdf version='1.10'/>").errors


def test_the_command_says_one_sentence(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_bytes(b"\x00\x01\x02")
    done = run_ksl("check", path)
    assert done.returncode == 2 and done.stdout == "" and done.stderr.startswith("ksl: ") and done.stderr.count("\n") == 1


def chain_of_followers(count: int) -> str:
    """Joints of which each mimics the one before, and as many that mimic what is not there."""
    links = "".join(f'<link name="l{k}"/>' for k in range(2 * count + 1))
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/>'
        + (f'<mimic joint="j{k - 1}"/>' if 0 < k < count else f'<mimic joint="absent{k}"/>' if k else "")
        + "</joint>"
        for k in range(2 * count)
    )
    return f'<robot name="r">{links}{joints}</robot>'


def test_mimic_chains_are_linear_work():
    """Quadratic, in parts cubic, before: 2,000 joints took minutes."""

    def check(count: int) -> int:
        findings = []
        done = work(lambda: findings.extend(findings_of_bytes(chain_of_followers(count).encode())))
        assert len([f for f in findings if f.rule == "mimic-chain"]) == count - 2
        assert len([f for f in findings if f.rule == "mimic-unknown"]) == count
        assert max(len(f.found) for f in findings) < 300
        return done

    assert_linear(check, 60)


def test_loops_of_followers_are_told_once_each(check):
    loop = lambda a, b: f'<joint name="{a}" type="continuous"><parent link="base"/><child link="l{a}"/><mimic joint="{b}"/></joint><link name="l{a}"/>'
    text = '<robot name="r"><link name="base"/>' + loop("d", "a") + loop("a", "b") + loop("b", "c") + loop("c", "a") + loop("x", "x") + "</robot>"
    found = [f.found for f in check(text) if f.rule == "mimic-loop"]
    assert found == ["it mimics a → b → c → a: no joint leads", "it mimics x: no joint leads"]


@pytest.mark.parametrize("uri", ["a" * 300 + ".stl", f"package://{'p' * 300}/hand.stl", "/dev/null", "file:///dev/null", "/", ".."])
def test_names_of_meshes_that_no_file_has(check, uri):
    """Too long for the system, or of a device or a folder."""
    mesh = f'<visual><geometry><mesh filename="{uri}"/></geometry></visual>'
    findings = check(more(link("hand", inside=mesh), hinge("wrist", "fore", "hand")))
    assert {"mesh-missing", "package-missing"} & set(findings.rules)


@pytest.mark.filterwarnings("error")
def test_numbers_near_the_end_of_their_range(check):
    """No infinite values, which JSON lacks, no warnings of numpy, and no axis that its repair makes zero."""
    moments = ('ixx="0.0283" iyy', 'ixx="1e308" iyy'), ('iyy="0.0084"', 'iyy="-1e308"')
    lengths = ('xyz="0 0 0.15"', 'xyz="1e308 1e308 0"'), ('size="0.1 0.1 0.4"', 'size="1e308 1e308 1e308"')
    findings = check(changed(('axis xyz="0 0 1"', 'axis xyz="1.7e308 -1.7e308 0"'), *moments, *lengths))
    json.dumps(findings.as_dict(), allow_nan=False)
    (axis,) = [f for f in findings if f.rule == "axis-not-unit"]
    assert axis.value is None and '"0.707106781187 -0.707106781187 0"' in axis._fix()


def test_geometry_without_thickness(check):
    """The centroid lies in the direction in which the geometry has no length, by which its moments are compared."""
    assert "inertia-too-large" in check(changed(('size="0.1 0.1 0.4"', 'size="0.1 0.1 0"'))).rules


def test_masses_of_two_sides_that_are_not_positive(check):
    """One negative, one zero: the larger one was divided by."""
    sides = [link("left_hand", mass=-1), link("right_hand", mass=0), hinge("l", "fore", "left_hand"), hinge("r", "fore", "right_hand")]
    assert {"mass-negative", "symmetry-mass"} <= set(check(more(*sides)).rules)


URDF_MASS = '<robot name="r"><link name="a"><inertial><mass value="{}"/></inertial></link></robot>'
SDF_MASS = '<sdf version="1.10"><model name="m"><link name="a"><inertial><mass>{}</mass></inertial></link></model></sdf>'


@pytest.mark.parametrize("file", [URDF_MASS, SDF_MASS], ids=["urdf", "sdf"])
@pytest.mark.parametrize("number", ["{}x", "{}.{}x", ".{}x", "1e{}x"])
def test_a_number_of_many_digits_is_linear_work(file, number, monkeypatch):
    """20,000 digits with a letter behind them took 8 s."""
    steps = count_patterns(monkeypatch, xml_file, file_rules)

    def check(digits: int) -> int:
        before = steps()
        found = findings_of_bytes(file.format(number.replace("{}", "1" * digits)).encode())
        assert "number-unreadable" in [f.rule for f in found]
        return steps() - before

    assert_linear(check, 200)


class Attributes(MutableMapping):
    """Attributes of an element, of which each is looked for from the first one on, as lxml does it: line by line, so that `work` counts it."""

    def __init__(self, real: MutableMapping) -> None:
        self.real = real

    def __getitem__(self, name: str) -> str:
        for each in self.real:
            if each == name:
                break
        return self.real[name]

    def __setitem__(self, name: str, value: str) -> None:
        self.real[name] = value

    def __delitem__(self, name: str) -> None:
        del self.real[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.real)

    def __len__(self) -> int:
        return len(self.real)


@pytest.fixture
def counted_elements(monkeypatch):
    """Elements of XML whose attributes and children are looked for in Python."""
    from lxml import etree

    class Element(etree.ElementBase):
        @property
        def attrib(self) -> Attributes:
            return Attributes(super().attrib)

        def get(self, name: str, default: str | None = None) -> str | None:
            return self.attrib.get(name, default)

        def find(self, path: str, *more: object) -> object:
            for child in self:
                if child.tag == path:
                    break
            return super().find(path, *more)

    def parser(**options: object) -> etree.XMLParser:
        made = real(**options)
        made.set_element_class_lookup(etree.ElementDefaultClassLookup(element=Element))
        return made

    real = etree.XMLParser
    monkeypatch.setattr(etree, "XMLParser", parser)


STRANGERS = {
    "attributes": lambda n: "<link " + " ".join(f'b{k}="1"' for k in range(n)) + "/>",
    "attributes with values": lambda n: "<link><extension " + " ".join(f'b{k}="1"' for k in range(n)) + "/></link>",
    "elements": lambda n: "x<a/>" * n,
    "elements of many names": lambda n: "".join(f"<e{k}/>" for k in range(n)),
    "elements in a joint": lambda n: "<joint>" + "".join(f"<limit{k}x/>" for k in range(n)) + "</joint>",
    "a name that does not end": lambda n: "<" + "a" * n,
}


@pytest.mark.parametrize("what", STRANGERS)
def test_many_strangers_are_linear_work(what, counted_elements, monkeypatch):
    """Quadratic before: 40,000 attributes of one element took 14 s, and 40,000 elements 54 s."""
    text = lambda n: f'<robot name="r">{STRANGERS[what](n)}</robot>'.encode()
    more_than_are_looked_at = limits.ATTRIBUTES + 1 if "attributes" in what else 200
    assert_linear(lambda n: work(lambda: findings_of_bytes(text(n))), more_than_are_looked_at)
    steps = count_patterns(monkeypatch, xml_file, file_rules, tags)

    def search(n: int) -> int:
        before = steps()
        findings_of_bytes(text(n))
        return steps() - before

    assert_linear(search, 50)


@pytest.mark.parametrize("name", ["xmlns", "xmlns:x", "xmlns\n=", "xmlns" + " " * 2000, "xmlns:" + "x" * 2000])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_long_namespace_is_refused(name, encoding):
    """Each element has it in its name: with 160 kB of it, 32,000 elements took 6 s.  So no element is looked at, however many there are."""
    found = []

    def check(elements: int) -> int:
        given = f'<robot name="r">\n<a {name.removesuffix("=")}="{"u" * 8000}">{"<b/>" * elements}</a></robot>'.encode(encoding)
        return work(lambda: found.append(findings_of_bytes(given)))

    _, few, many = map(check, (10, 10, 1000))
    assert many == few
    assert [(f.rule, f.line) for f in found[-1]] == [("xml-syntax", 3 if "\n" in name else 2)]
    text = f'<robot name="r">\n<a {name.removesuffix("=")}="{{}}"><b/></a></robot>'
    if len(name) < 1000:
        assert "xml-syntax" not in [f.rule for f in findings_of_bytes(text.format("u" * 1000).encode(encoding))]
    assert "xml-syntax" not in [f.rule for f in findings_of_bytes(f'<robot name="r" note="{"u" * 9000}"/>'.encode(encoding))]


def test_misspelt_names_are_told_at_each_place(check):
    """The same name in many joints, and beside names that are not compared since there are too many."""
    joints = "".join(hinge(f"j{k}", "fore", f"l{k}").replace('velocity="2"', 'velocty="2"') + link(f"l{k}") for k in range(80))
    assert joints.count("velocty") == 80
    found = [f for f in check(more(joints)) if f.rule == "unknown-attribute"]
    assert len(found) == 80 and all(f.repair == "Did you mean velocity?" and f.fixable for f in found)
    found = [f for f in check(more("".join(f"<e{k}/>" for k in range(80)) + "<Link/>")) if f.rule == "unknown-tag"]
    assert [f.repair for f in found if f.fixable] == ["Did you mean <link>?"]


@pytest.mark.parametrize("inside", ["", "<!-- b -->"])
def test_comments_before_a_document_type_are_linear_work(tmp_path, inside, monkeypatch):
    """It doubled with each of them; a comment in the root element was taken for the end of these, and what stands before it was written twice."""
    path = tmp_path / "robot.urdf"
    robot = f'<robot name="r">{inside}<link name="a"/></robot>'
    steps = count_patterns(monkeypatch, write)

    def repaired(comments: int) -> int:
        before = steps()
        path.write_text('<?xml version="1.0"?>' + "<!-- a -->" * comments + "<!DOCTYPE robot>" + robot)
        fix(path, tmp_path / "out.urdf", force=True)
        text = (tmp_path / "out.urdf").read_text()
        assert text.count("<!-- a -->") == comments and text.endswith(robot) and text.count("<robot") == 1
        return steps() - before

    assert_linear(repaired, 3)
