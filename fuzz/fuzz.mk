# Readers against texts that nobody wrote.  Each target also runs with faults that were planted, and must find them.
# make fuzz-short   20 s for each target
# make fuzz         10,000,000 executions for each, about half an hour on two cores for each two; writes its records

.PHONY: fuzz fuzz-short fuzz-build
FUZZ_RUNS ?= 10000000

fuzz-short: fuzz-build
	$(BIN)/python fuzz/run.py --seconds 20

fuzz: fuzz-build
	$(BIN)/python fuzz/run.py --runs $(FUZZ_RUNS)

fuzz-build: $(VENV)/.tools
	scripts/system_packages.sh fuzz
	CC=clang CXX=clang++ cmake -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja -S . -B build/fuzz -DKSL_FUZZ=ON >/dev/null
	cmake --build build/fuzz -- --quiet
