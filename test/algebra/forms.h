// The tables that make_forms.py writes: one row per function, in the same order in each.
#pragma once

extern "C" {
typedef void form(void **arguments, void *result);
extern form *const forms_inline[];
extern form *const forms_linked[];
}

struct form_row {
  const char *name;
  const char *arguments; // one letter each: d double, f float, i int numbers; n an int, p a ptrdiff_t
};
extern form *const forms_template[]; // null where a function is not for lanes
extern const form_row form_rows[];
extern const int form_count;
