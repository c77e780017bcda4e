"""Rows of neighbours, read whole and turned into columns in registers, so that a pair loop reads contiguous memory.

Left to itself the compiler gathers a pair loop's operands one column at a time, eight indexed loads each; a row that is
read whole costs two loads of four doubles per half cache line, and shuffles that turn eight rows into eight columns.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

ROW = 16  # doubles in a packed row: two cache lines
WIDTH = 8  # doubles in the widest vector, and rows that are turned at once
COUNT, INDEX = ir.IntType(32), ir.IntType(64)
QUARTER, HALF = ir.VectorType(ir.DoubleType(), 4), ir.VectorType(ir.DoubleType(), 2)
EVEN, ODD = (0, 8, 2, 10, 4, 12, 6, 14), (1, 9, 3, 11, 5, 13, 7, 15)
LOWER, UPPER = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
SIDE_BY_SIDE, FIRSTS, SECONDS = (0, 1, 2, 3), (0, 4, 2, 6), (1, 5, 3, 7)
WHOLE_VECTORS = bool(get_host_cpu_features().get("avx512f"))  # of WIDTH doubles

Piece = tuple[int, int, Any]
"""Column, first row and vector: what a turn gives."""


def shuffled(builder: Any, a: Any, b: Any, places: tuple[int, ...]) -> Any:
    """The vector of these entries of a followed by b."""
    mask = ir.Constant(ir.VectorType(COUNT, len(places)), [ir.Constant(COUNT, i) for i in places])
    return builder.shuffle_vector(a, b, mask)


def turned(builder: Any, quarters: list[Any]) -> list[Piece]:
    """Four columns of eight from eight rows of four: rows i and i + 4 side by side, then 2 x 2 blocks, then 4 x 4."""
    r = [shuffled(builder, quarters[i], quarters[i + 4], tuple(range(8))) for i in range(4)]
    even = [shuffled(builder, r[i], r[i + 1], EVEN) for i in (0, 2)]
    odd = [shuffled(builder, r[i], r[i + 1], ODD) for i in (0, 2)]
    columns = [shuffled(builder, a, b, half) for half in (LOWER, UPPER) for a, b in (even, odd)]
    return [(c, 0, values) for c, values in enumerate(columns)]


def turned_halves(builder: Any, halves: list[Any]) -> list[Piece]:
    """Two columns of eight, each in two vectors of four, from eight rows of two.

    Rows i and i + 2 are put side by side as they are loaded, so that nothing crosses the middle of a register: where
    vectors hold four doubles that is slow, and turning takes two thirds of the time.
    """
    pieces = []
    for first in (0, 4):
        a, b = (shuffled(builder, halves[first + i], halves[first + i + 2], SIDE_BY_SIDE) for i in (0, 1))
        pieces += [(c, first, shuffled(builder, a, b, own)) for c, own in enumerate((FIRSTS, SECONDS))]
    return pieces


def _turn_rows(_context, table, numbers, _first, columns, _place, used):
    """columns[c, place + i] = table[numbers[first + i], c] for i < 8 and c < used, 8 or 16 (a literal).

    table: (N, ROW) float64; numbers: (M,) uint32, with M >= first + 8; columns: (ROW, length) float64 with
    length >= place + 8; all contiguous, bounds are the caller's.
    """
    row_major = [t for t in (table, columns) if isinstance(t, types.Array) and t.layout == "C" and t.ndim == 2]
    if len(row_major) < 2 or {t.dtype for t in row_major} != {types.float64} or numbers.dtype != types.uint32:
        raise TypingError("turn_rows takes contiguous (N, ROW) float64 rows, uint32 numbers and float64 columns")
    if not isinstance(used, types.IntegerLiteral) or used.literal_value not in (WIDTH, ROW):
        raise TypingError(f"turn_rows turns {WIDTH} or {ROW} columns, given as a literal")
    signature = types.void(table, numbers, types.int64, columns, types.int64, used)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        rows, listed, target = (context.make_array(signature.args[i])(context, builder, args[i]) for i in (0, 1, 3))
        length = cgutils.unpack_tuple(builder, target.shape, 2)[1]
        starts = []
        for i in range(WIDTH):
            number = builder.load(builder.gep(listed.data, [builder.add(args[2], INDEX(i))]))
            starts.append(builder.mul(builder.zext(number, INDEX), INDEX(ROW)))
        part, turn = (QUARTER, turned) if WHOLE_VECTORS else (HALF, turned_halves)
        for column in range(0, signature.args[5].literal_value, part.count):
            places = [builder.gep(rows.data, [builder.add(start, INDEX(column))]) for start in starts]
            parts = [builder.load(builder.bitcast(at, part.as_pointer()), align=8) for at in places]
            for c, first, values in turn(builder, parts):  # stored at once, or registers run out
                at = builder.add(builder.mul(INDEX(column + c), length), builder.add(args[4], INDEX(first)))
                to = builder.gep(target.data, [at])
                builder.store(values, builder.bitcast(to, values.type.as_pointer()), align=8)
        return context.get_dummy_value()

    return signature, generate


turn_rows: Any = intrinsic(prefer_literal=True)(_turn_rows)
