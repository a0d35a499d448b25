"""No module of python/ksl recognises a note or an error by its words: both have kinds (ksl.base.notes, ksl.base.errors)."""

import ast

import pytest
from syntax import FILES, PYTHON, nodes

FOREIGN = {
    "mechanism/core_sentences.py": "of the compiled core, which hands over text alone",
    "robot_files/xacro_files.py": "of xacro", "motions/files/bags.py": "of rosbags", "motions/files/csv_table.py": "of Arrow", "base/library_messages.py": "of libraries",
}  # fmt: skip
"""The modules that look at words of messages, and of whose."""
SAID = {"note", "notes", "doubt", "hint", "sentence", "message", "warning", "refusal", "reason"}
"""Names of variables and attributes that hold a sentence."""
BY_WORDS = {"startswith", "endswith", "find", "index", "count", "removeprefix", "removesuffix", "replace"}


def is_sentence(node: ast.expr, errors: set[str]) -> bool:
    """`str(e)` of a caught error, or what is called a sentence."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "str" and node.args:
        return isinstance(node.args[0], ast.Name) and node.args[0].id in errors
    return (isinstance(node, ast.Name) and node.id in SAID) or (isinstance(node, ast.Attribute) and node.attr in SAID)


def looks_at_words(node: ast.AST, errors: set[str]) -> bool:
    """`"…" in sentence`, `sentence.startswith("…")` and its like, `re.match("…", sentence)`."""
    if isinstance(node, ast.Compare):
        is_text = isinstance(node.left, ast.JoinedStr) or (isinstance(node.left, ast.Constant) and isinstance(node.left.value, str))
        return is_text and isinstance(node.ops[0], (ast.In, ast.NotIn)) and is_sentence(node.comparators[0], errors)
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return False
    on = node.func.value
    by_pattern = isinstance(on, ast.Name) and on.id == "re" and len(node.args) > 1 and is_sentence(node.args[1], errors)
    return by_pattern or (node.func.attr in BY_WORDS and is_sentence(on, errors))


def found(nodes_of_file: list[ast.AST]) -> list[int]:
    errors = {node.name for node in nodes_of_file if isinstance(node, ast.ExceptHandler) and node.name}
    return [node.lineno for node in nodes_of_file if looks_at_words(node, errors)]


def test_no_module_recognises_a_sentence_by_its_words():
    places = {str(file.relative_to(PYTHON / "ksl")): lines for file in FILES if (lines := found(nodes(file)))}
    assert {file: lines for file, lines in places.items() if file not in FOREIGN} == {}


@pytest.mark.parametrize(
    "line",
    ['"xacro" in str(e)', 'str(e).endswith("first")', 'note.startswith(f"{NOT_USED}visual (")', 're.match("link ", warning)', 'str(e).replace(MEND, "x")'],
)
def test_each_way_to_look_at_words_is_found(line):
    assert found(list(ast.walk(ast.parse(f"try:\n    pass\nexcept ValueError as e:\n    {line}")))) == [4]
