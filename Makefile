# make demo   sets everything up, runs the main job on a robot and a motion that ship with KSL, says where the report is
# make full   compiles what `make demo` leaves out: the kernels for this processor, whose batches are three to four times as fast
# make test   sets everything up, runs all tests
# make test-long  the tests of many random cases with fifty times as many, of C++ with both compilers and each instruction set, and on an
#              emulated Arm processor; writes test/long_results.md
# make quick  after a change of an algorithm: compiles what includes it and runs the C++ tests of the engine (QUICK=NAME: those cases alone)
# make bench  timings, beside what they are compared with (make bench-plots: and renews docs/performance.md)
# make bench-arm  instructions on an emulated Arm processor, beside Pinocchio's; renews their table in docs/performance.md
# make embedded  instructions, flash and stack of generated code on emulated microcontrollers; renews their tables in docs/microcontrollers.md
# make card   on a machine with a graphics card: tests and timings there, in ten minutes and without a network, with the KSL of PYTHON; writes build/card/card.json
# make release   all of the C algebra as one header, build/release/ksl.h
# make test-windows  the tests in C, and of the algebra, compiled for Windows, under Wine
# make compile-macos  the library and the tests in C and C++, compiled and linked for macOS
# make docs      the reference of the algebra in build/reference, from the headers, and what follows from api/algorithms/
# make site      the documentation as a site, build/site
# make ci     what CI runs on each change: make test, and beside it lint, abi and fuzz-short
# make format    C and C++ as .clang-format says, Python as pyproject.toml does
# make lint, coverage, mutate, sanitize, fuzz, golden, test-faults, abi, dist   long checks of what docs/trust.md promises; each writes its record
# make trust     runs the tests that promises name, and writes docs/trust.md from all records
# Each reuses what is there.  make clean removes all that was made.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(shell nproc)
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# Compilers run through ccache where it is, which `make test` installs.  What it keeps outlives clones of this folder, wherever they lie.
# A make that this one runs after the installation looks again.
ifeq ($(CMAKE_C_COMPILER_LAUNCHER)$(CMAKE_CXX_COMPILER_LAUNCHER),)
CMAKE_C_COMPILER_LAUNCHER := $(shell command -v ccache)
CMAKE_CXX_COMPILER_LAUNCHER := $(CMAKE_C_COMPILER_LAUNCHER)
endif
export CMAKE_C_COMPILER_LAUNCHER CMAKE_CXX_COMPILER_LAUNCHER
export CCACHE_BASEDIR := $(CURDIR)
export CCACHE_NOHASHDIR := 1
# Those that have a precompiled header, too: a fifth of a build whose kernels are kept.  No source names the time.
export CCACHE_SLOPPINESS := pch_defines,time_macros

# No developer's shell hides a fault or makes one: what changes how Python, compilers, terminals or the tests behave is kept
# from all commands.  Which compiler or PYTHON is used, and what package clients, caches and the network need, stays.
DROPPED := PYTHON% PYTEST% HYPOTHESIS% KSL% SKBUILD% NPY_% CMAKE_ARGS CMAKE_BUILD_TYPE CMAKE_GENERATOR% CTEST% DESTDIR \
  CFLAGS CXXFLAGS CPPFLAGS LDFLAGS LANG LANGUAGE LC_% COLUMNS LINES FORCE_COLOR NO_COLOR CLICOLOR% TTY_% TYPER_%
unexport $(filter-out PYTHON,$(filter $(DROPPED),$(.VARIABLES)))

SOURCES := $(shell find include src python cmake -type f -not -name '*.pyc') CMakeLists.txt pyproject.toml

.PHONY: demo full test test-c test-gcc test-clang test-python build-gcc build-clang quick test-long bench bench-build bench-plots bench-arm embedded card release docs clean
.DELETE_ON_ERROR:

# What is installed serves; else KSL is compiled for a first look.
demo: $(firstword $(wildcard $(VENV)/.tested $(VENV)/.installed) $(VENV)/.first_look)
	$(BIN)/ksl loads examples/robots/panda.urdf examples/motions/panda_pick.csv -o out/panda_pick
	@if [ -e $(VENV)/.first_look ]; then echo "KSL is compiled for a first look. \`make full\` compiles it for this processor: batches are then three to four times as fast"; fi

full: $(VENV)/.installed

# One job compiles with clang and installs libraries, the other installs packages, compiles with gcc and runs that: each waits for the network in turn.
test: $(VENV)/.tools
	$(MAKE) --no-print-directory -j2 test-gcc $(VENV)/.tested
	$(MAKE) --no-print-directory test-clang test-python

# C and C++.  Optimising kernels takes most of the time, and is done once: what is tested is what users build, with clang.  gcc makes a debug build
# of two sets: workspaces are NaN where nothing has been computed, and thousands of states of every interface would take too long.  It alone has the
# tests of single functions: with clang, too, they would take a minute more.  It counts the work of readers, so that a test can say how it grows.
# `make test-long` runs all tests with all sets and both compilers.
# (folder below build/, CC, CXX, options of CMake)
build = CC=$(2) CXX=$(3) cmake -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja -S . -B build/$(1) -DKSL_TESTS=ON \
  -DPython3_EXECUTABLE=$(CURDIR)/$(BIN)/python -DKSL_WERROR=ON $(4) >/dev/null && cmake --build build/$(1) -- --quiet
run_ctest = ctest --test-dir build/$(1) --output-on-failure -j $(CMAKE_BUILD_PARALLEL_LEVEL)
test-c: test-gcc test-clang
test-gcc: build-gcc
	$(call run_ctest,gcc)
test-clang: build-clang
	$(call run_ctest,clang)

build-clang: $(VENV)/.tested
	$(call build,clang,clang,clang++,-DKSL_UNIT_TESTS=OFF)

build-gcc: $(VENV)/.packages
	$(call build,gcc,gcc,g++,-DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG= -DCMAKE_CXX_FLAGS_DEBUG= \
	  "-DKSL_INSTRUCTION_SETS=x86_64_v3;x86_64_v4" -DKSL_INTERFACE_TESTS=OFF -DKSL_COUNT_WORK=ON)

# One set, every algorithm a unit of its own, so that little is compiled again.  The first time takes as long as a build.
quick: $(VENV)/.packages
	$(call build,quick,clang,clang++,-DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS_DEBUG=-O0" "-DKSL_INSTRUCTION_SETS=x86_64_v3" -DKSL_UNITY_BUILD=OFF \
	  -DKSL_INTERFACE_TESTS=OFF) engine_test
	build/quick/test/engine/engine_test $(if $(QUICK),"--test-case=*$(QUICK)*")

# In a clean clone each worker would take ten seconds to rewrite assertions so that they tell their values: what fails is run once more with them.
run_pytest = KSL_LIBRARY=$(CURDIR)/build/clang/libksl.so $(BIN)/python -m pytest
test-python: $(VENV)/.tested build-gcc test-clang
	$(run_pytest) --assert=plain -n $(CMAKE_BUILD_PARALLEL_LEVEL) --dist loadfile --no-loadscope-reorder test || \
	  { $(run_pytest) --last-failed --last-failed-no-failures none test; exit 1; }

# Half an hour of processor time.  The result is written whether it is good or not, and is to be committed.
long = -DKSL_LONG_TESTS=ON -DKSL_TEST_MANY_STATES=ON
test-long: $(VENV)/.tested $(VENV)/.packages
	scripts/system_packages.sh trust
	rm -f build/long_*.xml
	status=0; \
	$(call build,long-gcc,gcc,g++,$(long)) || status=1; \
	$(call build,long-clang,clang,clang++,$(long)) || status=1; \
	for compiler in gcc clang; do for set in x86-64-v2 x86-64-v3 x86-64-v4; do \
	  KSL_ISA=$$set $(call run_ctest,long-$$compiler) --output-junit $(CURDIR)/build/long_$$compiler-$$set.xml || status=1; \
	done; done; \
	$(run_pytest) --long -n $(CMAKE_BUILD_PARALLEL_LEVEL) --dist loadfile \
	  --junitxml=build/long_pytest.xml test/algebra test/laws test/contract/neon_test.py || status=1; \
	$(BIN)/python scripts/trust/long_results.py test/long_results.md build/long_*.xml && exit $$status

# Peers are built once, in build/bench/peers (about ten minutes), KSL with gcc and with clang each time.  Where the processor has AVX-512, KSL gets
# the kernels for AVX2 beside those of a source build, so that both are measured.
bench_sets = $(if $(shell grep -sow -m1 avx512vl /proc/cpuinfo),-DKSL_INSTRUCTION_SETS=all,-UKSL_INSTRUCTION_SETS)
# Where KSL is installed: benchmarks in Python run in the environment of the other libraries, which has the same Python.
site_of_ksl = $$($(BIN)/python -c 'import pathlib, ksl; print(pathlib.Path(ksl.__file__).parents[1])')
bench: bench-build
	$(BIN)/python bench/run.py build/bench
	$(BIN)/python bench/growth.py build/bench
	for script in loops simulation compiled; do PYTHONPATH=$(site_of_ksl) build/bench/venv/bin/python bench/$$script.py || exit 1; done

# The same, and then the plots and tables of docs/performance.md.
bench-plots: bench-build
	$(BIN)/python bench/run.py build/bench --docs

bench-arm: $(VENV)/.tools
	scripts/system_packages.sh bench-arm
	$(MAKE) --no-print-directory -s -j $(CMAKE_BUILD_PARALLEL_LEVEL) -f bench/arm.mk
	$(BIN)/python bench/arm/count.py build/bench

embedded: $(VENV)/.tested
	scripts/system_packages.sh embedded
	$(BIN)/python bench/embedded/measure.py build/embedded

# KSL is there already, from a wheel, and nothing is installed.
card:
	$(PYTHON) bench/card.py

bench-build: $(VENV)/.installed
	scripts/system_packages.sh bench
	$(MAKE) --no-print-directory -s -j2 -f bench/peers.mk
	for compiler in gcc clang; do \
	  case $$compiler in gcc) cxx=g++; programs="compare flops algebra_bench growth";; clang) cxx=clang++; programs=;; esac; \
	  cmake -S . -B build/bench/$$compiler -DCMAKE_C_COMPILER=$$compiler -DCMAKE_CXX_COMPILER=$$cxx -DKSL_BENCHMARKS=ON $(bench_sets) \
	    -DKSL_BENCH_OUTPUT=$(CURDIR)/build/bench >/dev/null && \
	  cmake --build build/bench/$$compiler --target ksl_peer $$programs -- --no-print-directory -s || exit 1; \
	done

release:
	$(PYTHON) scripts/single_header.py build/release/ksl.h

docs:
	$(PYTHON) scripts/reference_pages.py build/reference
	$(PYTHON) scripts/generate.py

$(VENV)/.tools:
	scripts/system_packages.sh demo
	@echo "a Python environment in $(VENV)"
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q scikit-build-core nanobind ninja numpy
	touch $@

# pip's build names the compiler that Python was built with, whatever else is there.  So clang is named here, unless somebody has named another.
named = $(filter environment% command%,$(origin CC) $(origin CXX))
clang_if_it_works = $(shell printf '\043include <span>\nstatic_assert(__clang_major__ >= 14);\n' | clang++ -std=c++20 -x c++ -fsyntax-only - 2>/dev/null && echo CC=clang CXX=clang++)
install = $(if $(named),,$(clang_if_it_works)) $(BIN)/python scripts/install.py --no-build-isolation $(1) '.[loads,check]'
$(VENV)/.installed: $(VENV)/.tools $(SOURCES)
	$(call install)
	rm -f $(VENV)/.first_look
	touch $@

$(VENV)/.first_look: $(VENV)/.tools $(SOURCES)
	$(call install,--config-settings=build-dir=build/first_look --config-settings=cmake.define.KSL_FIRST_LOOK=ON)
	touch $@

$(VENV)/.packages: $(VENV)/.tools scripts/system_packages.sh
	scripts/system_packages.sh test
	touch $@

$(VENV)/.tested: $(VENV)/.tools $(SOURCES)
	CC=clang CXX=clang++ $(BIN)/python -m pip install -q --no-compile --no-build-isolation --config-settings=build-dir=build/clang \
	  --config-settings=cmake.define.KSL_WERROR=ON '.[test]'
	rm -f $(VENV)/.installed $(VENV)/.first_look
	touch $@

-include scripts/ci.mk scripts/lint/lint.mk scripts/abi/abi.mk scripts/dist/dist.mk scripts/site/site.mk scripts/trust/trust.mk fuzz/fuzz.mk test/golden/golden.mk test/mutate/mutate.mk \
  test/coverage/coverage.mk test/sanitize/sanitize.mk test/faults/faults.mk test/windows/windows.mk test/macos/macos.mk

clean:
	rm -rf build out $(VENV)
