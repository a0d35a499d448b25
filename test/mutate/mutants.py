"""What mutated Python calls, and the import of mutated modules.

All mutants of a scope are compiled at once; the one whose number is in `active` runs.  What a module computes when it is imported, its tables and
constants, has been computed before a mutant is chosen: `recompute` does so again, and hands the result to all modules that have the old one."""

import ast
import builtins
import importlib.abc
import importlib.util
import mmap
import operator
import sys

import python_mutator

BINARY = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "**": operator.pow}
OTHER = {"+": "-", "-": "+", "*": "/", "/": "*", "**": "*"}
COMPARED = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne}
OTHERS = {"<": (">=", "<="), "<=": (">", "<"), ">": ("<=", ">="), ">=": ("<", ">"), "==": ("!=",), "!=": ("==",)}

ROOM = 20002  # numbers of mutants
RUN, JOINED = 1, 2

active = 0
reached = mmap.mmap(-1, ROOM)  # shared with the copies of this process in which commands run; RUN: there was a choice, JOINED: lists or texts alone


def on(number):
    reached[number] = RUN
    return number == active


def binary(number, op, a, b):
    """Of sets, lists and texts there is no other operation: the mutant is none."""
    if isinstance(a, (set, frozenset, list, tuple, str, bytes, dict)) or isinstance(b, (str, list, tuple)):
        reached[number] = reached[number] or JOINED
    elif on(number):
        return BINARY[OTHER[op]](a, b)
    return BINARY[op](a, b)


IN_PLACE = {"+": operator.iadd, "-": operator.isub, "*": operator.imul, "/": operator.itruediv, "**": operator.ipow}


def augmented(number, op, x, a):
    """`x += a` in place, as arrays take it."""
    if isinstance(x, (set, list, tuple, str, bytes, dict)):
        reached[number] = reached[number] or JOINED
    elif on(number):
        return IN_PLACE[OTHER[op]](x, a)
    return IN_PLACE[op](x, a)


def negative(number, x):
    return x if on(number) else -x


def flip(number, x):
    return not x if on(number) else x


def is_whole(x):
    return getattr(getattr(x, "dtype", None), "kind", "") in ("i", "u") or isinstance(x, int)


def compare(number, op, a, b):
    """The boundary, which is the second change, moves between integers alone, as in C++."""
    for k, other in enumerate(OTHERS[op]):
        if (k == 0 or (is_whole(a) and is_whole(b))) and on(number + k):
            return COMPARED[other](a, b)
    return COMPARED[op](a, b)


def either(number, op, *late):
    stops_at = (op == "or") != on(number)
    for x in late[:-1]:
        value = x()
        if bool(value) == stops_at:
            return value
    return late[-1]()


def number(number, x):
    if not on(number):
        return x
    return (x * 1.1 if x else 0.1) if isinstance(x, float) else x + max(1, x // 10)


class Importer(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Loads the modules of a scope mutated, from the sources of the project."""

    def __init__(self, root, scope):
        self.trees, self.mutants = python_mutator.mutated(root, scope)
        self.files = {python_mutator.module_name(root, f): f for f in python_mutator.files(root, scope)}
        self.by_number = {m.number: m for m in self.mutants}
        builtins._ksl_mutants = sys.modules[__name__]

    def find_spec(self, fullname, path=None, target=None):
        if fullname not in self.trees:
            return None
        file = self.files[fullname]
        package = [str(file.parent)] if file.name == "__init__.py" else None
        return importlib.util.spec_from_file_location(fullname, file, loader=self, submodule_search_locations=package)

    def exec_module(self, module):
        exec(compile(self.trees[module.__name__], str(self.files[module.__name__]), "exec"), module.__dict__)

    def recompute(self, number):
        """Computes the statement of a module's body in which the mutant is, and those below that use what it gives."""
        mutant = self.by_number[number]
        name = next(n for n, f in self.files.items() if str(f).endswith(mutant.file))
        module = sys.modules.get(name)
        if module is None or mutant.statement is None:
            return
        first, *below = self.trees[name].body[mutant.statement :]
        changed, old = names_given(first), dict(module.__dict__)
        exec(compile(ast.Module([first], []), mutant.file, "exec"), module.__dict__)
        for statement in (s for s in below if isinstance(s, (ast.Assign, ast.AnnAssign))):
            if changed & {x.id for x in ast.walk(statement) if isinstance(x, ast.Name)}:
                changed |= names_given(statement)
                exec(compile(ast.Module([statement], []), mutant.file, "exec"), module.__dict__)
        for other in [m for m in list(sys.modules.values()) if m is not module]:
            for n, value in list(getattr(other, "__dict__", {}).items()):
                for k in changed if n.lstrip("_").upper() == n.lstrip("_") else ():
                    if value is old.get(k, NONE) and (n == k or not isinstance(value, (int, str))):  # small ones are one object everywhere
                        setattr(other, n, module.__dict__[k])


NONE = object()


def names_given(statement):
    """The names that an assignment gives."""
    targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
    return {t.id for t in targets if isinstance(t, ast.Name)}


def install(root, scope):
    importer = Importer(root, scope)
    sys.meta_path.insert(0, importer)
    return importer
