// The costs that doc comments state are those of the bodies.
#include <doctest/doctest.h>

#include "counting.hpp"
#include "flops.h"

#include <cstring>
#include <string>

TEST_CASE("stated flops, roots, sines and arctangents are what a counting scalar counts") {
  CHECK(flop_row_count >= 170);
  for (int k = 0; k < flop_row_count; k++) {
    const flop_row &row = flop_rows[k];
    CAPTURE(std::string(row.file));
    CAPTURE(std::string(row.name));
    row.run();
    CHECK(counting::flops == row.stated.flops);
    CHECK(counting::roots == row.stated.roots);
    CHECK(counting::sines == row.stated.sines);
    CHECK(counting::arctangents == row.stated.arctangents);
  }
}

TEST_CASE("an adjoint transformation costs 24 multiplications and 18 additions, no more") {
  int found = 0;
  for (int k = 0; k < flop_row_count; k++)
    for (const char *name : {"product_Ads", "product_Adinvs", "product_CoAdc", "product_CoAdinvc"})
      if (std::strcmp(flop_rows[k].name, name) == 0) {
        found++;
        flop_rows[k].run();
        CHECK(counting::flops <= 42);
      }
  CHECK(found == 4);
}
