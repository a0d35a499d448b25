#!/bin/sh
# Runs the tests in an instrumented build and writes what ran: FOLDER/exports/*.json.  Usage: run.sh FOLDER PYTHON
# FOLDER is the build that `make coverage` makes; tests of Python use its module and its libksl.so.
set -eu
build=$1 python=$2 root=$PWD
rm -rf "$build/profiles" "$build/exports"
mkdir -p "$build/profiles" "$build/exports" "$build/pyroot/ksl"
ln -sf "$root"/python/ksl/* "$build"/python/_core*.so "$build/pyroot/ksl/"

# Each process writes a file of its own, named after the program's code and the process.
export LLVM_PROFILE_FILE="$build/profiles/%m-%p.profraw"
ctest --test-dir "$build" --output-on-failure -j "${CMAKE_BUILD_PARALLEL_LEVEL:-2}"
# What calls C and C++: the algebra through ctypes, and every interface of the extension.  This build has one instruction set,
# and is not optimised.
KSL_TEST_CC="clang -fprofile-instr-generate -fcoverage-mapping" KSL_LIBRARY="$build/libksl.so" PYTHONPATH="$build/pyroot" "$python" -m pytest -q -n "${CMAKE_BUILD_PARALLEL_LEVEL:-2}" --dist loadfile \
  --deselect test/mechanism/batch_test.py::test_every_instruction_set_gives_the_same_bits \
  test/algebra test/mechanism test/model test/robot_files test/simulation test/engine test/base test/identify test/arrays test/load_cases/loads_test.py test/laws

llvm-profdata merge "$build"/profiles/*.profraw -o "$build/all.profdata"
rm -rf "$build/profiles"
for program in "$build"/libksl.so "$build"/test/*/*_test; do
  llvm-cov export "$program" -instr-profile="$build/all.profdata" >"$build/exports/$(basename "$program").json" 2>"$build/exports/notes"
done
