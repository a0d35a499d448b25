# Readers get texts that a fuzzer makes.  The long run also plants faults into each target, which must find them.
# make fuzz-short   the seeds and some thousand texts of each target, sixteen times as many where its reader has changed since a run that was recorded,
#                   and the same ones each time; FUZZ_OPTIONS=--record notes what has run, in test/trust/read/fuzz.txt
# make fuzz         10,000,000 executions of each target, 1,000,000 of those of packed files (npz, parquet, mcap, ros1, ros2, xlsx,
#                   mat), usd and loops, and its record;
#                   most take less than an hour of one core, mjcf, parquet and ros2 more

.PHONY: fuzz fuzz-short fuzz-build fuzz-build-short
FUZZ_RUNS ?= 10000000

fuzz-short fuzz-build-short: FUZZ_PROGRAMS := fuzz_urdf fuzz_sdf fuzz_urdf_round_trip
fuzz-short: fuzz-build-short
	$(BIN)/python fuzz/run.py --short $(FUZZ_OPTIONS)

fuzz: fuzz-build
	$(BIN)/python fuzz/run.py --runs $(FUZZ_RUNS)

fuzz-build fuzz-build-short: $(VENV)/.tested
	scripts/system_packages.sh fuzz
	$(BIN)/python -c 'import atheris' 2>/dev/null || $(BIN)/python -m pip install -q atheris==3.0.0 # its patcher of bytecode is used
	CC=clang CXX=clang++ cmake -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja -S . -B build/fuzz -DKSL_FUZZ=ON -DKSL_WERROR=ON >/dev/null
	cmake --build build/fuzz $(addprefix --target ,$(FUZZ_PROGRAMS)) -- --quiet
