"""What the text of a C or C++ file says: which lines hold code, and where blocks of statements begin.

Compilers count nothing in a template that is never instantiated, nor in a branch of an `if constexpr` that every instantiation
discards.  So the blocks are found in the text.  A block at which no compiled function has a region never ran."""

import re

TOKEN = re.compile(r'[A-Za-z_]\w*|"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)+\'|\d[\w\'.]*|->|::|\S')


def blanked(text):
    """The text with blanks for comments, literals and preprocessor lines; line ends and columns stay."""

    def blanks(match):
        return re.sub(r"[^\n]", " ", match.group())

    # digit separators are no characters: a quote after a digit is part of the number
    pattern = r'//[^\n]*|/\*.*?\*/|"(?:[^"\\\n]|\\.)*"|(?<![0-9a-fA-F])\'(?:[^\'\\\n]|\\.)+\'|^[ \t]*#(?:[^\n\\]|\\.|\\\n)*'
    return re.sub(pattern, blanks, text, flags=re.S | re.M)


def code_lines(text):
    """Numbers of the lines with code: more than blanks, comments, preprocessor lines, brackets, `else`, `do` and `try`.
    __builtin_unreachable() is no code either."""
    return {
        number
        for number, line in enumerate(blanked(text).split("\n"), 1)
        if not re.fullmatch(r"[\s{}();,]*(else|do|try|__builtin_unreachable\(\))?[\s{}();,]*", line)
    }


def conditional_sections(text):
    """The ranges of lines between #if, #elif, #else and #endif."""
    open_ones = []
    for number, line in enumerate(text.split("\n"), 1):
        directive = re.match(r"[ \t]*#[ \t]*(if|el|endif)", line)
        if not directive:
            continue
        if directive.group(1) != "if":
            yield range(open_ones.pop(), number)
        if directive.group(1) != "endif":
            open_ones.append(number)


def tokens(text):
    """(token, line, column) of the blanked text."""
    for number, line in enumerate(blanked(text).split("\n"), 1):
        for match in TOKEN.finditer(line):
            yield match.group(), number, match.start() + 1


def closing(list_of, opening):
    """Index of the bracket that closes the one at an index."""
    pairs, depth = {"(": ")", "{": "}", "[": "]"}, 0
    left, right = list_of[opening][0], pairs[list_of[opening][0]]
    for i in range(opening, len(list_of)):
        depth += (list_of[i][0] == left) - (list_of[i][0] == right)
        if depth == 0:
            return i
    raise ValueError(f"line {list_of[opening][1]}: a bracket that nothing closes")


# After these, between ")" and "{" of a function or lambda.
QUALIFIERS = {"const", "noexcept", "override", "final", "mutable", "KSL_INLINED"}


def statement_end(all_tokens, first):
    """Index after a statement: a block, or what ends with a semicolon."""
    i = first
    while all_tokens[i][0] != ";":
        if all_tokens[i][0] in "({[":
            closed = closing(all_tokens, i)
            if i == first and all_tokens[i][0] == "{":
                return closed + 1
            i = closed
        i += 1
    return i + 1


def constexpr_branches(all_tokens):
    """(Index of the first token, index after the last) of what each `if constexpr`, and the else after it, selects."""
    for i, (token, _, _) in enumerate(all_tokens):
        if token == "if" and all_tokens[i + 1][0] == "constexpr":
            first = closing(all_tokens, i + 2) + 1
            if all_tokens[first][0] in {"if", "for", "while", "switch"}:  # whose own parts are regions
                continue
            end = statement_end(all_tokens, first)
            yield first, end
            if all_tokens[end][0] == "else" and all_tokens[end + 1][0] not in {"if", "for", "while", "switch"}:
                yield end + 1, statement_end(all_tokens, end + 1)


def opening(all_tokens, closed):
    """Index of the parenthesis that the one at an index closes."""
    depth = 0
    for i in range(closed, -1, -1):
        depth += (all_tokens[i][0] == ")") - (all_tokens[i][0] == "(")
        if depth == 0:
            return i
    raise ValueError(f"line {all_tokens[closed][1]}: a bracket that nothing opened")


def opens_body(all_tokens, i):
    """Whether the brace at an index opens the body of a function, a lambda or a statement with a condition: it follows the
    parentheses of parameters or of a condition."""
    k = i - 1
    while k >= 0 and all_tokens[k][0] in QUALIFIERS:
        k -= 1
    if k < 0 or all_tokens[k][0] != ")":
        return False
    before = opening(all_tokens, k) - 1
    # requirements hold no code; what a switch holds are the regions of its cases
    return before >= 0 and all_tokens[before][0] not in {"requires", "switch"}


def block_ends(text):
    """(line, column) where a body or branch begins → line where it ends."""
    all_tokens = list(tokens(text))
    ends = {i: closing(all_tokens, i) for i in range(len(all_tokens)) if all_tokens[i][0] == "{" and opens_body(all_tokens, i)}
    ends |= {first: end - 1 for first, end in constexpr_branches(all_tokens)}
    return {all_tokens[first][1:]: all_tokens[last][1] for first, last in ends.items()}
