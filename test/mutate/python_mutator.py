"""Mutated Python: every sign, operator, comparison and number of a module, all in one code object.

A mutated expression `a + b` becomes a call that computes a − b if its mutant is active (mutants.py).  Operands are evaluated once, in order.
What computes nothing is left out: annotations, defaults of arguments, decorators, bodies of classes, words of messages and `if TYPE_CHECKING`.  So is
what no result shows: a bound of rounding or of memory that is a tenth larger, the end of a slice behind which there is nothing, and what divides zeros."""

import ast
from dataclasses import dataclass

ROOMS = ("sizing", "load_cases", "motions", "sweeps", "checks", "mechanism", "simulation", "model", "robot_files", "comparison",
         "generation", "drivetrain", "small_motions", "parts")  # fmt: skip

BINARY = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*")}
COMPARED = {
    ast.Lt: [("<", ">="), ("<", "<=")], ast.LtE: [("<=", ">"), ("<=", "<")], ast.Gt: [(">", "<="), (">", ">=")], ast.GtE: [(">=", "<"), (">=", ">")],
    ast.Eq: [("==", "!=")], ast.NotEq: [("!=", "==")],
}  # fmt: skip
KINDS = {"+": "sign", "-": "sign"}
ROUNDING = 1e-6  # numbers below are bounds of rounding: a tenth more is as good
ENDS = (6, 12)  # of six-vectors and of poses: [3:6] and [3:12:4] end where these do


@dataclass(frozen=True)
class Mutant:
    number: int
    file: str
    line: int
    kind: str  # sign, operator or number
    code: str  # the expression
    change: str
    statement: int | None = None  # of the module's statements, the one that computes it when the module is imported

    def text(self):
        return f"{self.file}:{self.line}: {self.code}: {self.change}"


class Mutator(ast.NodeTransformer):
    """Numbers the mutants of one file after the other, from `first` on."""

    def __init__(self, first=1):
        self.next, self.mutants = first, []

    def file(self, name, text):
        """The mutated tree of a module."""
        self.name, self.source, self.statement = name, text, None
        tree = ast.parse(text)
        body = []
        for k, statement in enumerate(tree.body):
            self.statement = k if isinstance(statement, (ast.Assign, ast.AnnAssign)) else None
            self.bound = self.is_bound(statement)
            body.append(self.visit(statement) if not self.is_quiet(statement) else statement)
        tree.body = body
        return ast.fix_missing_locations(tree)

    def is_quiet(self, statement):
        """Imports, texts, aliases of types, and what runs for type checkers alone."""
        if isinstance(statement, ast.If):
            return "TYPE_CHECKING" in ast.unparse(statement.test)
        return not isinstance(statement, (ast.Assign, ast.AnnAssign, ast.FunctionDef, ast.ClassDef, ast.If))

    def is_bound(self, statement):
        """`MOST_BYTES = …`: so much is taken at most.  What is compared with it is mutated, and the number itself is not."""
        targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        return all(f"{name}_".startswith("MOST_") for target in targets for name in [x.id for x in ast.walk(target or ast.Name("")) if isinstance(x, ast.Name)])

    def new(self, node, kind, changes):
        code = " ".join((ast.get_source_segment(self.source, node) or "").split())
        code = code if len(code) <= 80 else code[:77] + "..."
        first = self.next
        self.next += len(changes)
        self.mutants += [Mutant(first + i, self.name, node.lineno, kind, code, c, self.statement) for i, c in enumerate(changes)]
        return first

    def call(self, node, function, number, *arguments):
        where = ast.Attribute(ast.Name("_ksl_mutants", ast.Load()), function, ast.Load())
        return ast.copy_location(ast.Call(where, [ast.Constant(number), *arguments], []), node)

    def visit_FunctionDef(self, node):  # neither arguments and their defaults, nor decorators
        node.body = [self.visit(statement) for statement in node.body]
        return node

    def visit_ClassDef(self, node):
        node.body = [self.visit(s) if isinstance(s, ast.FunctionDef) else s for s in node.body]
        return node

    def visit_Lambda(self, node):
        node.body = self.visit(node.body)
        return node

    def visit_AnnAssign(self, node):
        node.value = node.value and self.visit(node.value)
        return node

    def visit_Raise(self, node):
        return node

    def visit_JoinedStr(self, node):
        return node

    def visit_Subscript(self, node):
        """Parts of types look like subscripts; those of arrays lose at most a sign inside."""
        node.value = self.visit(node.value)
        if not isinstance(node.slice, ast.Constant):
            node.slice = self.visit(node.slice)
        return node

    def visit_Slice(self, node):
        """The end of a slice from a number on, as of [3:6], is left as it is where it is that of the array."""
        ends = isinstance(node.lower, ast.Constant) and isinstance(node.upper, ast.Constant) and node.upper.value in ENDS
        parts = ("lower", "step") if ends else ("lower", "upper", "step")
        for name in parts:
            if getattr(node, name) is not None:
                setattr(node, name, self.visit(getattr(node, name)))
        return node

    def visit_BinOp(self, node):
        self.generic_visit(node)
        if type(node.op) not in BINARY or any(isinstance(x, (ast.JoinedStr, ast.List)) or self.is_text(x) for x in (node.left, node.right)):
            return node
        old, new = BINARY[type(node.op)]
        return self.call(node, "binary", self.new(node, KINDS.get(old, "operator"), [f"{old} → {new}"]), ast.Constant(old), node.left, node.right)

    def is_text(self, node):
        return isinstance(node, ast.Constant) and isinstance(node.value, (str, bytes))

    def visit_UnaryOp(self, node):
        if isinstance(node.operand, ast.Constant) and isinstance(node.op, ast.USub):
            return self.call(node, "negative", self.new(node, "sign", ["minus removed"]), node.operand)
        self.generic_visit(node)
        if isinstance(node.op, ast.USub):
            return self.call(node, "negative", self.new(node, "sign", ["minus removed"]), node.operand)
        if isinstance(node.op, ast.Not):
            return self.call(node, "flip", self.new(node, "operator", ["not removed"]), node)
        return node

    def visit_AugAssign(self, node):
        node.value = self.visit(node.value)
        if type(node.op) not in BINARY:
            return node
        old, new = BINARY[type(node.op)]
        number = self.new(node, KINDS.get(old, "operator"), [f"{old}= → {new}="])
        before = ast.parse(ast.unparse(node.target), mode="eval").body
        return ast.copy_location(ast.Assign([node.target], self.call(node, "augmented", number, ast.Constant(old), before, node.value)), node)

    def visit_Compare(self, node):
        self.generic_visit(node)
        if len(node.ops) != 1 or type(node.ops[0]) not in COMPARED:
            return node
        changes = COMPARED[type(node.ops[0])]
        number = self.new(node, "operator", [f"{old} → {new}" for old, new in changes])
        return self.call(node, "compare", number, ast.Constant(changes[0][0]), node.left, node.comparators[0])

    def visit_BoolOp(self, node):
        """`a and b` becomes `a or b`; operands are evaluated as late as before."""
        self.generic_visit(node)
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        late = [ast.Lambda(ast.arguments([], [], None, [], [], None, []), x) for x in node.values]
        if any(isinstance(x, (ast.NamedExpr, ast.Await, ast.Yield)) for value in node.values for x in ast.walk(value)):
            return node
        number = self.new(node, "operator", [f"{old} → {new}"])
        return self.call(node, "either", number, ast.Constant(old), *late)

    def visit_Constant(self, node):
        if isinstance(node.value, bool) or not isinstance(node.value, (int, float)) or (isinstance(node.value, int) and abs(node.value) < 3):
            return node
        if self.bound or 0 < abs(node.value) < ROUNDING:
            return node
        return self.call(node, "number", self.new(node, "number", ["a tenth more"]), node)

    def visit_keyword(self, node):
        """Arguments by name take numbers, too, but for what only lays out text."""
        if node.arg not in ("width", "indent", "maxsplit", "digits"):
            node.value = self.visit(node.value)
        return node

    def visit_Call(self, node):
        """`significant(x, 3)` and the like only print."""
        if isinstance(node.func, ast.Name) and node.func.id in ("significant", "listed", "count", "print"):
            return node
        if self.is_guard(node):
            node.args[:2] = [self.visit(x) for x in node.args[:2]]
            return node
        return self.generic_visit(node)

    def is_guard(self, node):
        """`np.where(size > 0, size, 1.0)`: the 1.0 divides what is zero."""
        if not (isinstance(node.func, ast.Attribute) and node.func.attr == "where" and len(node.args) == 3 and isinstance(node.args[0], ast.Compare)):
            return False
        (condition, x, other), zero = node.args, node.args[0].comparators[0]
        is_number = lambda of, number: isinstance(of, ast.Constant) and of.value == number
        return ast.dump(condition.left) == ast.dump(x) and is_number(zero, 0) and is_number(other, 1)

    def visit_MatchValue(self, node):
        return node


def files(root, scope):
    return sorted((root / "python/ksl" / scope).rglob("*.py"))


def module_name(root, file):
    parts = file.relative_to(root / "python").with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def mutated(root, scope):
    """{module: mutated tree} and the mutants of a scope, numbered from 1 on."""
    mutator, trees = Mutator(), {}
    for f in files(root, scope):
        trees[module_name(root, f)] = mutator.file(str(f.relative_to(root)), f.read_text(encoding="utf-8"))
    return trees, mutator.mutants
