// The table that make_forms.py writes: what each doc comment states, and a run of the body on a counting scalar.
#pragma once

struct flop_row {
  const char *name, *file;
  struct { int flops, roots, sines, arctangents; } stated;
  void (*run)();
};
extern const flop_row flop_rows[];
extern const int flop_row_count;
