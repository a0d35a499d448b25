"""What a few words of a USD file ask Pixar's library to compose: counted before, and no less than what the library makes."""

import numpy as np
import pytest

import ksl

pytest.importorskip("pxr")
from pxr import Sdf, Usd

from ksl.robot_files.usd import amounts

HEAD = '#usda 1.0\n(\n metersPerUnit = 1\n upAxis = "Z"{}\n)\n'
BODY = 'def "body" ( prepend apiSchemas = ["PhysicsRigidBodyAPI"] )\n{\n}\n'
ARCS = ("references", "payload", "inherits", "specializes")


def twice(arc, levels):
    """Each class has two prims that refer to the next one."""
    classes = "".join(f'class "c{k}"\n{{\n' + "".join(f'def "p{i}" ( {arc} = </c{k + 1}> )\n{{\n}}\n' for i in range(2)) + "}\n" for k in range(levels))
    return f'{classes}class "c{levels}"\n{{\n}}\n{BODY}def "r" ( {arc} = </c0> )\n{{\n}}\n'


def diamonds(arc, levels):
    """Each class refers to two that refer to the next one."""
    classes = "".join(
        f'class "c{k}" ( {arc} = [</a{k}>, </b{k}>] )\n{{\n}}\n' + "".join(f'class "{x}{k}" ( {arc} = </c{k + 1}> )\n{{\n}}\n' for x in "ab")
        for k in range(levels)
    )
    return f'{classes}class "c{levels}"\n{{\n}}\n{BODY}def "r" ( {arc} = </c0> )\n{{\n}}\n'


def relocated(levels):
    """Each prim has two that come from another place, and refer to the next one."""
    text, moves = f'def "t{levels}"\n{{\n}}\n', []
    for k in range(levels):
        inner = "".join(f'def "p{i}" ( references = </t{k + 1}> )\n{{\n}}\n' for i in range(2))
        text += f'def "l{k}"\n{{\n{inner}}}\ndef "a{k}" ( references = </l{k}> )\n{{\n}}\ndef "t{k}"\n{{\n}}\n'
        moves += [f"</a{k}/p{i}>: </t{k}/q{i}>" for i in range(2)]
    return text + BODY, f"\n relocates = {{{', '.join(moves)}}}"


def in_file(path, text, layer=""):
    path.write_text(HEAD.format(layer) + text)
    return path


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
@pytest.mark.parametrize("arc", ARCS)
@pytest.mark.parametrize("nested", [twice, diamonds])
def test_arcs_that_bring_twice_as_much_at_each_level_are_bounded(tmp_path, arc, nested):
    assert ksl.load(in_file(tmp_path / "few.usda", nested(arc, 4)), masses="optional").link_names == ["world", "body"]
    with pytest.raises(ksl.DescriptionError, match=r"many.usda: its references, payloads, .* bring more than 2,097,152 prims, .* are the most that are read"):
        ksl.load(in_file(tmp_path / "many.usda", nested(arc, 15)), masses="optional")


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_arcs_from_file_to_file_are_bounded(tmp_path):
    for k in range(18):
        in_file(
            tmp_path / f"{k}.usda",
            f'def "r"\n{{\n def "a" ( payload = @./{k + 1}.usda@ )\n{{\n}}\n def "b" ( references = @./{k + 1}.usda@</r> )\n{{\n}}\n}}\n',
            '\n defaultPrim = "r"',
        )
    in_file(tmp_path / "18.usda", f'def "r"\n{{\n{BODY}}}\n', '\n defaultPrim = "r"')
    assert len(ksl.load(tmp_path / "15.usda", masses="optional").link_names) == 9
    with pytest.raises(ksl.DescriptionError, match="bring more than 2,097,152 prims"):
        ksl.load(tmp_path / "0.usda")


@pytest.mark.skipif(not hasattr(Sdf.Layer, "relocates"), reason="before USD 24.11 layers relocate nothing")
@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_what_is_relocated_is_bounded(tmp_path):
    assert ksl.load(in_file(tmp_path / "few.usda", *relocated(4)), masses="optional").link_names == ["world", "body"]
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "few.usda"))
    assert 100 < composed(Usd.Stage.Open(layer)) <= amounts.brought(layer)
    with pytest.raises(ksl.DescriptionError, match="bring more than 2,097,152 prims"):
        ksl.load(in_file(tmp_path / "many.usda", *relocated(18)), masses="optional")


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_sublayers_of_sublayers_are_bounded(tmp_path):
    for k in range(12):
        for of in "ab":
            in_file(tmp_path / f"{of}{k}.usda", "", f"\n subLayers = [@./a{k + 1}.usda@, @./b{k + 1}.usda@]")
    for of in "ab":
        in_file(tmp_path / f"{of}12.usda", BODY)
    assert ksl.load(tmp_path / "a6.usda", masses="optional").link_names == ["world", "body"]
    outer = in_file(tmp_path / "outer.usda", 'def "r" ( references = @./a0.usda@</body> )\n{\n}\n')
    for file in (tmp_path / "a0.usda", outer):
        with pytest.raises(ksl.DescriptionError, match="its sublayers, or those of a layer that it refers to, are more than 1,000 with those that they name"):
            ksl.load(file)


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_variants_count_where_they_are_selected(tmp_path):
    big = twice("references", 15).replace('def "r" ( references = </c0> )', 'over "unused"')
    inside = 'def "v" (\n variants = {{ string s = "{}" }}\n prepend variantSets = "s"\n)\n{{\n variantSet "s" = {{ "no" {{\n }}\n "yes" ( references = </c0> ) {{\n }} }}\n}}'
    assert ksl.load(in_file(tmp_path / "no.usda", 'class "x"\n{\n}\n' + BODY + inside.format("no") + "\n"), masses="optional")
    with pytest.raises(ksl.DescriptionError, match="bring more than 2,097,152 prims"):
        ksl.load(in_file(tmp_path / "yes.usda", big.replace("class", "over") + inside.format("yes") + "\n"))


def random_stage(rng):
    """Arcs of all kinds from classes to later ones, or to prims of these."""
    names, text = 3, ""

    def arcs(k):
        given = []
        for arc in ARCS:
            to = [f"</c{int(c)}{rng.choice(['', '/p0', '/p1'])}>" for c in rng.integers(k + 1, names + 1, size=rng.integers(0, 3))]
            given += [f"{arc} = [{', '.join(dict.fromkeys(to))}]"] if to and rng.random() < 0.5 else []
        return "\n".join(given)

    for k in range(names):
        inner = "".join(f'def "p{i}" ( {arcs(k)} )\n{{\n def "q" ( {arcs(k)} )\n{{\n}}\n}}\n' for i in range(2))
        text += f'class "c{k}" ( {arcs(k)} )\n{{\n{inner}}}\n'
    return HEAD.format("") + text + f'class "c{names}"\n{{\n def "p0"\n{{\n}}\n def "p1"\n{{\n}}\n}}\ndef "r" ( references = </c0> )\n{{\n}}\n'


def composed(stage):
    """Sites that have opinions, each counted once for every arc that leads to it, of all prims that the library has composed."""
    total = 0
    for prim in Usd.PrimRange.Stage(stage, Usd.PrimAllPrimsPredicate):
        pending = [(child, 1) for child in prim.GetPrimIndex().rootNode.children]
        while pending:
            node, depth = pending.pop()
            total += depth if node.hasSpecs else 0
            pending += [(child, depth + 1) for child in node.children]
    return total


def test_no_less_is_counted_than_the_library_composes():
    counts = []
    for seed in range(20):
        layer = Sdf.Layer.CreateAnonymous(".usda")
        layer.ImportFromString(random_stage(np.random.default_rng(seed)))
        counted = amounts.brought(layer)
        if counted < 1000:  # the library's tree of arcs takes long to walk through
            counts.append((composed(Usd.Stage.Open(layer)), counted))
    made, counted = np.array(counts).T
    assert len(counts) > 6 and made.max() > 100 and (made <= counted).all()
