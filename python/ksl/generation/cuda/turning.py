"""Rows of states in and out of threads.

A thread has one state.  Rows of a few numbers, as callers have them, lie so that neighbouring threads would read apart from each other.  So the 32 threads of a
warp copy 32 rows together, numbers that are neighbours at once, into a tile of shared memory that belongs to the warp, and each reads its own row there.  Results
are written into tiles, which are then copied to where the caller wants them.  No warp waits for another.

In the text `@` stands for the prefix of all names, and REAL for the scalar.
"""

from __future__ import annotations

from collections.abc import Sequence

WARP = 32
MOST = 174
"""Numbers of a state that are in tiles: 45 KB of double for a warp.  Arrays that are more come through a tile in pieces, and are then the thread's own."""
PIECE = 16
"""Numbers of a piece."""

ROWS = """\
/* Where row i begins in a tile: rows are an odd number of places apart, so that all 32 banks of shared memory work at once. */
template <int columns> static __device__ __forceinline__ int @row_at(int i) { return i * (columns | 1); }

/* Some columns of 32 rows into a tile, or back.  left: so many of these rows there are. */
template <int columns, bool in> static __device__ __forceinline__ void @copy(REAL *rows, long long stride, long long left, REAL *tile) {
  const int lane = threadIdx.x & 31;
  if (stride == columns && left >= 32) { /* one behind the other: where the number of columns is odd, the tile is as the rows are */
#pragma unroll 16
    for (int k = 0; k < columns; ++k) {
      const int i = lane + 32 * k, place = columns & 1 ? i : i + i / columns;
      if (in)
        tile[place] = rows[i];
      else
        rows[i] = tile[place];
    }
  } else {
#pragma unroll 1
    for (int i = lane; i < 32 * columns; i += 32) {
      const int row = i / columns, k = i % columns;
      if (row < left) {
        if (in)
          tile[@row_at<columns>(row) + k] = rows[row * stride + k];
        else
          rows[row * stride + k] = tile[@row_at<columns>(row) + k];
      }
    }
  }
}

/* A long row in pieces, into numbers of the thread's own.  row: which of the 32 it is. */
template <int size> static __device__ __forceinline__ void @take(const REAL *rows, long long stride, long long left, int row, REAL *tile, REAL *own) {
  constexpr int piece = size < PIECE ? size : PIECE, rest = size % piece;
#pragma unroll 1
  for (int c = 0; c + piece <= size; c += piece) {
    __syncwarp();
    @copy<piece, true>((REAL *)rows + c, stride, left, tile);
    __syncwarp();
#pragma unroll
    for (int k = 0; k < piece; ++k)
      own[c + k] = tile[@row_at<piece>(row) + k];
  }
  if constexpr (rest != 0)
    @take<rest>(rows + (size - rest), stride, left, row, tile, own + (size - rest));
}

/* The other way round. */
template <int size> static __device__ __forceinline__ void @give(REAL *rows, long long stride, long long left, REAL *tile, const REAL *own) {
  constexpr int piece = size < PIECE ? size : PIECE, rest = size % piece;
  const int lane = threadIdx.x & 31;
#pragma unroll 1
  for (int c = 0; c + piece <= size; c += piece) {
    __syncwarp();
#pragma unroll
    for (int k = 0; k < piece; ++k)
      tile[@row_at<piece>(lane) + k] = own[c + k];
    __syncwarp();
    @copy<piece, false>(rows + c, stride, left, tile);
  }
  if constexpr (rest != 0)
    @give<rest>(rows + (size - rest), stride, left, tile, own + (size - rest));
}
"""
COALESCED = """\
/* One number of all states is an array, number k of a state at [k * step]: neighbouring threads read neighbours. */
struct @inputs {
  const REAL *first;
  long long step;
  __device__ __forceinline__ REAL operator[](int k) const { return first[k * step]; }
};

struct @results {
  REAL *first;
  long long step;
  __device__ __forceinline__ REAL &operator[](int k) const { return first[k * step]; }
};
"""


def in_tiles(sizes: Sequence[int]) -> list[bool]:
    """Which arrays of so many numbers each have tiles of their own."""
    found, numbers = [], 0
    for size in sizes:
        found.append(numbers + (size | 1) <= MOST)
        numbers += (size | 1) * found[-1]
    return found


def tile_numbers(sizes: Sequence[int]) -> int:
    """So many numbers all tiles of a warp have."""
    stay = in_tiles(sizes)
    return WARP * (sum(size | 1 for size, stays in zip(sizes, stay) if stays) + (PIECE | 1) * (not all(stay)))


def turning(prefix: str, scalar: str, rows: bool, coalesced: bool) -> str:
    """What kernels of rows call, and the arrays of those of the coalesced layout."""
    text = "\n".join([ROWS] * rows + [COALESCED] * coalesced)
    for word, meaning in {"PIECE": str(PIECE), "REAL": scalar, "@": prefix}.items():
        text = text.replace(word, meaning)
    return text
