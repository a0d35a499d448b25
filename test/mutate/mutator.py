"""Mutated copies of C and C++ files: every sign, index and operator mutant of a file in one text.

A mutated expression `a + b` becomes `ksl_mutate::add(17, a, b)`: mutants.hpp computes a − b if mutant 17 is active.  Lines stay
where they are.  Files are parsed by tree-sitter's grammar of C++; what it can't parse is not mutated."""

import re
from dataclasses import dataclass

import tree_sitter
import tree_sitter_cpp

PARSER = tree_sitter.Parser(tree_sitter.Language(tree_sitter_cpp.language()))

ARITHMETIC = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide", "%": "remainder"}
COMPARISONS = {"<": "less", ">": "greater", "<=": "at_most", ">=": "at_least"}
EQUALITIES = {"==": "equal", "!=": "unequal"}
LOGICAL = {"&&": "||", "||": "&&"}
ASSIGNMENTS = {"+=": "add_assign", "-=": "subtract_assign", "*=": "multiply_assign", "/=": "divide_assign", "&=": "and_assign", "|=": "or_assign"}
SHOWN = {
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
    "%": "/",
    "<": ">=",
    ">": "<=",
    "<=": ">",
    ">=": "<",
    "==": "!=",
    "!=": "==",
    "+=": "-=",
    "-=": "+=",
    "*=": "/=",
    "/=": "*=",
    "&=": "|=",
    "|=": "&=",
}
MOVED = {"<": "<=", ">": ">=", "<=": "<", ">=": ">"}


def cycle(*names):
    return dict(zip(names, names[1:] + names[:1]))


# The member that is taken instead: another component, the other part of a spatial vector, the transposed element.
MEMBERS = (
    cycle("x", "y", "z")
    | {"w": "x"}
    | cycle("lin", "ang")
    | cycle("sine", "cosine")
    | cycle("linear", "angular")
    | cycle("Ixx", "Iyy", "Izz")
    | cycle("Ixy", "Iyz", "Izx")
    | cycle("Mxx", "Myy", "Mzz")
    | cycle("Mxy", "Myz", "Mzx")
    | cycle("m00", "m11", "m22")
    | {"m33": "m00"}
    | cycle("twice_sine", "twice_cosine")
    | cycle("cosine_sine", "sine_sine")
    | {f"m{i}{j}": f"m{j}{i}" for i in range(4) for j in range(4) if i != j}
    | cycle("m03", "m13", "m23")
    | cycle("m30", "m31", "m32")
)

# Text that the compiler needs at once, or that computes nothing.
SKIPPED = {
    "template_argument_list",
    "template_parameter_list",
    "type_descriptor",
    "sizeof_expression",
    "static_assert_declaration",
    "enumerator_list",
    "attribute_declaration",
    "attribute_specifier",
    "requires_clause",
    "requires_expression",
    "concept_definition",
    "noexcept",
    "decltype",
    "bitfield_clause",
    "alias_declaration",
    "using_declaration",
    "preproc_def",
    "preproc_function_def",
    "preproc_include",
    "comment",
    "string_literal",
    "ERROR",
    "abstract_function_declarator",
    "optional_parameter_declaration",
    "operator_name",
    "lambda_capture_specifier",
    "alignas_qualifier",
    "throw_statement",
}


@dataclass(frozen=True)
class Mutant:
    number: int
    file: str
    line: int
    kind: str  # sign, index or operator
    code: str  # the expression
    change: str

    def text(self):
        return f"{self.file}:{self.line}: {self.code}: {self.change}"


def readable(text: bytes) -> bytes:
    """The same text, as long, with names in place of the project's macros, which the grammar can't know."""
    blank = lambda found: b" " * len(found[0])
    text = re.sub(rb"\bKSL_(FN|HELPER|LANES|VALUE)\b", lambda found: b"inline".ljust(len(found[0])), text)
    text = re.sub(rb"\bKSL_INLINED\b", blank, text)
    text = re.sub(rb"\breal\b", b"long", text)
    text = re.sub(rb"\bKSL_INSTANTIATE\(\w+\)", blank, text)
    text = re.sub(rb"\bKSL(_OF)?\([\w ,]*\)(?=\()", lambda found: b"K" + b"_" * (len(found[0]) - 1), text)
    return re.sub(rb"\[\[\w+\]\]", blank, text)


def joins_text(node) -> bool:
    """Is a string literal among the terms of this sum?"""
    if node.type == "binary_expression" and node.child_by_field_name("operator").type == "+":
        return any(map(joins_text, node.children))
    return node.type in ("string_literal", "concatenated_string")


class Mutator:
    """Numbers the mutants of one file after the other, from `first` on."""

    def __init__(self, first=1):
        self.mutants = []
        self.next = first

    def file(self, name: str, text: bytes, dropped=frozenset()) -> bytes:
        """The mutated text.  `dropped`: (line, code, change) of mutants that do not compile."""
        self.name, self.source, self.dropped = name, text, dropped
        parsed = readable(text)
        assert len(parsed) == len(text)
        root = PARSER.parse(parsed).root_node
        out = self.render(root, False)
        result = self.source[: root.start_byte] + out + self.source[root.end_byte :]
        assert result.count(b"\n") == text.count(b"\n")
        return result

    def new(self, node, kind, change):
        """The number of a new mutant, or None if it was dropped.  Dropped ones keep their numbers, so that a file in which none was
        dropped stays as it is."""
        code = " ".join(self.source[node.start_byte : node.end_byte].decode().split())
        code = code if len(code) <= 80 else code[:77] + "..."
        line = node.start_point[0] + 1
        changes = [change] if isinstance(change, str) else change
        first = self.next
        self.next += len(changes)
        if any((self.name, line, code, c) in self.dropped for c in changes):
            return None
        self.mutants += [Mutant(first + i, self.name, line, kind, code, c) for i, c in enumerate(changes)]
        return first

    def render(self, node, fixed) -> bytes:
        """The text of a node.  `fixed`: nothing in it may be mutated."""
        fixed = fixed or node.type in SKIPPED
        if not fixed and node.type in ("declaration", "field_declaration"):  # the compiler evaluates constants
            fixed = any(c.type == "type_qualifier" and c.text == b"constexpr" for c in node.children)
        if fixed or not node.children:
            return self.source[node.start_byte : node.end_byte]
        pieces = [(c, self.render(c, self.is_fixed(node, c))) for c in node.children]
        return self.mutated(node, pieces) or self.joined(node, pieces)

    def is_fixed(self, node, child):
        """What the compiler needs at once, and asserts, which a release leaves out."""
        if node.type in ("array_declarator", "case_statement", "new_declarator"):
            field = "size" if node.type == "array_declarator" else "value"
            return child == node.child_by_field_name(field) or node.type == "new_declarator"
        if node.type == "call_expression" and node.child_by_field_name("function").text == b"assert":
            return True
        if node.type == "if_statement" and child == node.child_by_field_name("condition"):
            return any(c.type == "constexpr" for c in node.children)
        return False

    def joined(self, node, pieces, replaced=()):
        """The children with the text between them; `replaced`: other texts of some."""
        out, at = [], node.start_byte
        replaced = dict(replaced)
        for child, text in pieces:
            out.append(self.source[at : child.start_byte])
            out.append(replaced.get(child.id, text))
            at = child.end_byte
        return b"".join(out) + self.source[at : node.end_byte]

    def call(self, name, number, node, pieces, replaced=()):
        return b"ksl_mutate::%s(%d, " % (name.encode(), number) + self.joined(node, pieces, replaced) + b")"

    def mutated(self, node, pieces):
        method = getattr(self, node.type, None)
        return method(node, pieces) if method else None

    def binary_expression(self, node, pieces):
        token = node.child_by_field_name("operator")
        op = token.type
        comma = [(token.id, b",")]
        if op in ARITHMETIC:
            if op == "+" and joins_text(node):
                return None
            number = self.new(node, "sign" if op in "+-" else "operator", f"{op} → {SHOWN[op]}")
            return number and self.call(ARITHMETIC[op], number, node, pieces, comma)
        if op in COMPARISONS:
            if self.in_loop_condition(node):
                number = self.new(node, "index", "last pass left out")
                return number and self.call("loop_" + COMPARISONS[op], number, node, pieces, comma)
            number = self.new(node, "operator", [f"{op} → {SHOWN[op]}", f"{op} → {MOVED[op]}"])
            return number and self.call(COMPARISONS[op], number, node, pieces, comma)
        if op in EQUALITIES:
            number = self.new(node, "operator", f"{op} → {SHOWN[op]}")
            return number and self.call(EQUALITIES[op], number, node, pieces, comma)
        if op in LOGICAL:
            number = self.new(node, "operator", f"{op} → {LOGICAL[op]}")
            if not number:
                return None
            operands = [(c.id, b"ksl_mutate::flip(%d, bool(" % number + text + b"))") for c, text in pieces if c.is_named and c.type != "comment"]
            return b"ksl_mutate::flip(%d, " % number + self.joined(node, pieces, operands) + b")"
        return None

    def in_loop_condition(self, node):
        above = node.parent
        while above is not None and above.type in ("binary_expression", "parenthesized_expression"):
            node, above = above, above.parent
        return (
            above is not None
            and above.type in ("for_statement", "while_statement", "condition_clause")
            and (above.type != "condition_clause" or above.parent.type == "while_statement")
            and (above.type != "for_statement" or above.child_by_field_name("condition") == node)
        )

    def unary_expression(self, node, pieces):
        op = node.child_by_field_name("operator")
        if op.type == "-":
            number = self.new(node, "sign", "minus removed")
            return number and self.call("negative", number, node, pieces, [(op.id, b"")])
        if op.type == "!":
            number = self.new(node, "operator", "! removed")
            return number and b"ksl_mutate::flip(%d, " % number + self.joined(node, pieces) + b")"
        return None

    def assignment_expression(self, node, pieces):
        op = node.child_by_field_name("operator")
        if (
            op.type not in ASSIGNMENTS
            or (node.parent.type == "for_statement")
            or (node.parent.type == "comma_expression" and node.parent.parent.type == "for_statement")
        ):
            return None
        number = self.new(node, "sign" if op.type in ("+=", "-=") else "operator", f"{op.type} → {SHOWN[op.type]}")
        return number and self.call(ASSIGNMENTS[op.type], number, node, pieces, [(op.id, b",")])

    def field_expression(self, node, pieces):
        field = node.child_by_field_name("field")
        name = field.text.decode()
        if name not in MEMBERS or field.type != "field_identifier":
            return None
        if node.parent.type == "call_expression" and node.parent.child_by_field_name("function") == node:
            return None
        above = node.parent
        if above.type == "assignment_expression" and above.child_by_field_name("right").type == "initializer_list":
            return None  # a choice of two members takes no list
        number = self.new(node, "index", f".{name} → .{MEMBERS[name]}")
        if not number:
            return None
        plain = self.joined(node, pieces)
        other = self.joined(node, pieces, [(field.id, MEMBERS[name].encode())]).replace(b"\n", b" ")
        return b"(ksl_mutate::on(%d) ? " % number + other + b" : " + plain + b")"

    def subscript_argument_list(self, node, pieces):
        if len(node.named_children) != 1:
            return None
        argument = node.named_children[0]
        if argument.type == "number_literal" and argument.text.isdigit():
            value = int(argument.text)
            if value == 0 and node.parent.parent.type == "pointer_expression" and node.parent.parent.children[0].type == "&":
                return None  # &x[0] is where an array begins
            other = value - 1 if value else 1
            number = self.new(node.parent, "index", f"[{value}] → [{other}]")
            if not number:
                return None
            return self.joined(node, pieces, [(argument.id, b"ksl_mutate::on(%d) ? %d : %d" % (number, other, value))])
        if argument.type in ("identifier", "field_expression", "call_expression"):
            number = self.new(node.parent, "index", f"[{argument.text.decode()}] → [0]")
            text = next(text for c, text in pieces if c.id == argument.id)
            return number and self.joined(node, pieces, [(argument.id, b"ksl_mutate::index(%d, " % number + text + b")")])
        return None
