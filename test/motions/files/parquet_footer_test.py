"""Footers of Parquet files, written here as Thrift's compact protocol describes them: sizes of columns are found among fields of every kind."""

import struct

import pytest

from ksl.motions.files.parquet_footer import Chunk, row_groups

TRUE, FALSE, BYTE, I16, I32, I64, DOUBLE, BINARY, LIST, SET, MAP, STRUCT = range(1, 13)


def unsigned(n):
    return bytes([n]) if n < 128 else bytes([n & 127 | 128]) + unsigned(n >> 7)


def signed(n):
    return unsigned(2 * n if n >= 0 else -2 * n - 1)


def listed(kind, *elements):
    head = bytes([len(elements) << 4 | kind]) if len(elements) < 15 else bytes([0xF0 | kind]) + unsigned(len(elements))
    return head + b"".join(elements)


def fields(*of, long=False):
    """A struct of (number, kind, bytes), with numbers as steps from the last, or in full."""
    out, last = b"", 0
    for number, kind, data in of:
        step = number - last
        out += bytes([step << 4 | kind]) + data if 0 < step < 16 and not long else bytes([kind]) + signed(number) + data
        last = number
    return out + b"\0"


def chunks(data):
    return [group.columns for group in row_groups(data)]


OTHERS = [
    (20, TRUE, b""), (21, FALSE, b""), (22, BYTE, b"\x07"), (23, I16, signed(-300)), (24, I32, signed(1 << 30)), (60, DOUBLE, struct.pack("<d", 1.5)), (61, BINARY, unsigned(200) + bytes(range(200))),
    (62, LIST, listed(TRUE, *[b"\1"] * 3)), (63, SET, listed(BINARY, *[unsigned(3) + b"\xff\0\xff"] * 20)), (64, STRUCT, fields((1, LIST, listed(STRUCT, fields((2, I64, signed(5))), fields())))),
    (65, LIST, listed(DOUBLE, *[bytes(8)] * 2)),
]  # fmt: skip
"""Fields of all kinds, which nobody asks for."""


def footer(groups, long=False, more=()):
    column = lambda values, size: fields(
        (2, I64, signed(4)),
        (3, STRUCT, fields((1, I32, signed(5)), (5, I64, signed(values)), (6, I64, signed(size)), (7, I64, signed(9)), *OTHERS, long=long)),
        *OTHERS,
        long=long,
    )
    rows = [
        fields((1, LIST, listed(STRUCT, *[column(*c) for c in group])), (2, I64, signed(77)), (3, I64, signed(3 - len(group))), *OTHERS, long=long)
        for group in groups
    ]
    return fields(
        (1, I32, signed(2)), (2, LIST, listed(STRUCT, fields((4, BINARY, unsigned(1) + b"x")))), (4, LIST, listed(STRUCT, *rows)), *OTHERS, *more, long=long
    )


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize("groups", [[], [[(3, 24)]], [[(1 << 40, 70), (0, 0)], [(5, 1 << 33), (6, 127)]], [[(k, 8 * k) for k in range(17)]] * 20])
def test_sizes_of_columns(groups, long):
    whole = footer(groups, long)
    assert row_groups(whole) == [(3 - len(group), [Chunk(*c) for c in group]) for group in groups]
    for cut in range(1, min(len(whole), 300), 1 if len(groups) < 20 else 29):  # what is read up to there takes a while
        with pytest.raises(ValueError):
            chunks(whole[:-cut])


@pytest.mark.parametrize("number", [5, 6])
def test_sizes_that_are_no_numbers_are_none(number):
    """Nor are groups, columns and their data that are of another kind."""
    told = fields(*sorted([(11 - number, I64, signed(70)), (number, BINARY, unsigned(2) + b"\x08\x08")]))
    of = lambda data: fields((4, LIST, listed(STRUCT, fields((1, LIST, listed(STRUCT, data))))))
    assert chunks(of(fields((3, STRUCT, told)))) == [[Chunk(70, 0) if number == 6 else Chunk(0, 70)]]
    assert chunks(of(fields((3, BINARY, unsigned(len(told)) + told)))) == [[Chunk()]]
    assert chunks(fields((4, LIST, listed(STRUCT, fields((1, STRUCT, told)))))) == [[]] and chunks(fields((4, STRUCT, told))) == []


def nested(depth, kind):
    """So many structs or lists in each other, in a field."""
    inside = fields() if kind == STRUCT else listed(BYTE)
    for _ in range(depth - 1):
        inside = fields((1, STRUCT, inside)) if kind == STRUCT else listed(LIST, inside)
    return inside


@pytest.mark.parametrize("kind", [STRUCT, LIST])
def test_structs_and_lists_are_in_each_other_fifteen_times_at_most(kind):
    """And any number of them beside each other."""
    deepest = [(70 + k, kind, nested(15, kind)) for k in range(3)]
    assert chunks(footer([[(1, 2)]], more=deepest)) == [[Chunk(1, 2)]]
    with pytest.raises(ValueError, match="too deep"):
        chunks(footer([[(1, 2)]], more=[(70, kind, nested(16, kind))]))


def test_rows_that_are_no_number_are_none():
    of = lambda *told: row_groups(fields((4, LIST, listed(STRUCT, fields(*told)))))
    assert of((3, BINARY, unsigned(1) + b"\x08")) == of() == [(0, [])] and of((3, I32, signed(8))) == [(8, [])]


@pytest.mark.parametrize(
    "bad",
    [
        (70, MAP, b"\0"),
        (70, 13, b""),
        (70, I64, b"\xff" * 10),
        (70, LIST, b"\xf3" + unsigned(10_000)),
        (4, LIST, listed(I32, signed(1))),
        (70, BINARY, unsigned(10_000)),
    ],
)
def test_what_is_no_footer(bad):
    with pytest.raises(ValueError):
        chunks(footer([[(1, 2)]], more=[bad]))
