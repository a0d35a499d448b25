# What CI runs on each change: the tests, and beside them the static analysis, the comparison of the C interface, and a short run of each fuzz
# target.  Nothing is recorded.  What more than one of them needs is made first.  The tests have all cores where they can use them: lint is nice,
# and takes what is left.  A fuzz target that takes far longer than usual is stopped, so they have their part of the machine.
.PHONY: ci ci-builds
BESIDE := CMAKE_BUILD_PARALLEL_LEVEL=1 $(MAKE) --no-print-directory

ci:
	scripts/system_packages.sh demo test lint abi fuzz
	$(MAKE) --no-print-directory $(VENV)/.tools
	$(MAKE) --no-print-directory -j2 ci-builds
	$(PYTHON) scripts/side_by_side.py "test=$(MAKE) --no-print-directory test-clang test-python" "lint=nice -n 10 env $(BESIDE) lint-alone" \
	  "abi and fuzz-short=$(BESIDE) -k abi fuzz-short"

# The tests of the build with gcc run while packages are unpacked, which leaves a core idle.
ci-builds: test-gcc build-clang fuzz-build-short lint-tools
