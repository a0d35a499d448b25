# make demo   sets everything up, runs the main job on a robot and a motion that ship with KSL, says where the report is
# make test   sets everything up, runs all tests
# make test-long  the tests of many random cases with ten times as many; writes test/long_results.md
# make bench  timings, beside what they are compared with (make bench-plots: and renews docs/performance.md)
# make release   all of the C algebra as one header, build/release/ksl.h
# make docs      the reference in docs/reference, from the headers and from api/algorithms/
# Each reuses what is there.  make clean removes all that was made.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(shell nproc)
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# No developer's shell hides a fault or makes one: what changes how Python, compilers, terminals or the tests behave is kept
# from all commands.  Which compiler or PYTHON is used, and what package clients, caches and the network need, stays.
DROPPED := PYTHON% PYTEST% HYPOTHESIS% KSL% SKBUILD% NPY_% CMAKE_ARGS CMAKE_BUILD_TYPE CMAKE_GENERATOR% CTEST% DESTDIR \
  CFLAGS CXXFLAGS CPPFLAGS LDFLAGS LANG LANGUAGE LC_% COLUMNS LINES FORCE_COLOR NO_COLOR CLICOLOR% TTY_% TYPER_%
unexport $(filter-out PYTHON,$(filter $(DROPPED),$(.VARIABLES)))

SOURCES := $(shell find include src python cmake -type f -not -name '*.pyc') CMakeLists.txt pyproject.toml

.PHONY: demo test test-c test-python test-long bench bench-build bench-plots release docs clean
.DELETE_ON_ERROR:

demo: $(VENV)/.installed
	$(BIN)/ksl loads examples/robots/panda.urdf examples/motions/panda_pick.csv -o out/panda_pick

test: test-c test-python

# C and C++: the same tests with gcc and with clang.  gcc's kernels are there: the Python module was made in build/gcc, too.
# Compiling kernels takes most of the time.  So gcc compiles them for the lowest instruction set, and clang the algebra alone.  All that
# users get is tested by: make test TEST_SETS="x86_64_v2;x86_64_v3;x86_64_v4" CLANG_TARGETS=all CLANG_TESTS=.
TEST_SETS := x86_64_v2
CLANG_TARGETS := forms_test flops_test lanes_test spatial_test
CLANG_TESTS := forms|flops|lanes|spatial
test-c: $(VENV)/.tested
	for compiler in gcc clang; do \
	  case $$compiler in gcc) cxx=g++; targets=all; tests=.;; clang) cxx=clang++; targets='$(CLANG_TARGETS)'; tests='$(CLANG_TESTS)';; esac; \
	  CC=$$compiler CXX=$$cxx cmake -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja -S . -B build/$$compiler -DKSL_TESTS=ON "-DKSL_INSTRUCTION_SETS=$(TEST_SETS)" \
	    -DPython3_EXECUTABLE=$(CURDIR)/$(BIN)/python >/dev/null && \
	  cmake --build build/$$compiler --target $$targets -- --quiet && \
	  ctest --test-dir build/$$compiler -R "$$tests" --output-on-failure -j $(CMAKE_BUILD_PARALLEL_LEVEL) || exit 1; \
	done

test-python: $(VENV)/.tested test-c
	KSL_LIBRARY=$(CURDIR)/build/gcc/libksl.so $(BIN)/python -m pytest -n $(CMAKE_BUILD_PARALLEL_LEVEL) --dist loadfile test

# 200 s of processor time.  The result is written whether it is good or not, and is to be committed.
test-long: $(VENV)/.tested
	cmake --build build/gcc --target ksl >/dev/null
	KSL_LIBRARY=$(CURDIR)/build/gcc/libksl.so $(BIN)/python -m pytest --long -n $(CMAKE_BUILD_PARALLEL_LEVEL) --dist loadfile \
	  --junitxml=build/long_results.xml test/algebra; status=$$?; \
	$(BIN)/python scripts/long_results.py build/long_results.xml test/long_results.md && exit $$status

# Peers are built once, in build/bench/peers (about ten minutes), KSL with gcc and with clang each time.
bench: bench-build
	$(BIN)/python bench/run.py build/bench

# The same, and then the plots and tables of docs/performance.md.
bench-plots: bench-build
	$(BIN)/python bench/run.py build/bench --docs

bench-build: $(VENV)/.installed
	scripts/system_packages.sh bench
	$(MAKE) --no-print-directory -s -j2 -f bench/peers.mk
	for compiler in gcc clang; do \
	  case $$compiler in gcc) cxx=g++; programs="compare flops algebra_bench";; clang) cxx=clang++; programs=;; esac; \
	  cmake -S . -B build/bench/$$compiler -DCMAKE_C_COMPILER=$$compiler -DCMAKE_CXX_COMPILER=$$cxx -DKSL_BENCHMARKS=ON \
	    -DKSL_BENCH_OUTPUT=$(CURDIR)/build/bench >/dev/null && \
	  cmake --build build/bench/$$compiler --target ksl_peer $$programs -- --no-print-directory -s || exit 1; \
	done

release:
	$(PYTHON) scripts/single_header.py build/release/ksl.h

docs:
	$(PYTHON) scripts/reference_pages.py docs/reference
	$(PYTHON) scripts/generate.py

$(VENV)/.tools:
	scripts/system_packages.sh demo
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q scikit-build-core nanobind ninja numpy
	touch $@

$(VENV)/.installed: $(VENV)/.tools $(SOURCES)
	$(BIN)/python -m pip install -q --no-build-isolation '.[loads]'
	touch $@

$(VENV)/.tested: $(VENV)/.tools $(SOURCES)
	scripts/system_packages.sh test
	CC=gcc CXX=g++ $(BIN)/python -m pip install -q --no-build-isolation --config-settings=build-dir=build/gcc \
	  "--config-settings=cmake.define.KSL_INSTRUCTION_SETS=$(TEST_SETS)" '.[loads,test]'
	touch $(VENV)/.installed $@

clean:
	rm -rf build out $(VENV)
