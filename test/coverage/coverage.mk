# make coverage   the tests that run C and C++, in a build that counts (clang, one instruction set): every line and nearly every
#                 branch of algebra, engine, loader, batches and C API must run.  Half an hour of processor time.
# Lines for other instruction sets are left out by the preprocessor, and don't count.  What a precompiled header instantiates has no counters.

.PHONY: coverage
COUNTED := -O0 -fprofile-instr-generate -fcoverage-mapping
coverage: $(VENV)/.tested $(VENV)/.packages
	scripts/system_packages.sh trust
	$(BIN)/python scripts/trust/record.py coverage --command "make coverage" --begun
	$(BIN)/python -m pytest -q test/coverage
	mkdir -p build/coverage
	clang -c test/coverage/write_last.c -o build/coverage/write_last.o
	$(call build,coverage,clang,clang++,-DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG= -DCMAKE_CXX_FLAGS_DEBUG= \
	  "-DCMAKE_C_FLAGS=$(COUNTED)" "-DCMAKE_CXX_FLAGS=$(COUNTED)" -DCMAKE_EXE_LINKER_FLAGS=$(CURDIR)/build/coverage/write_last.o \
	  -DKSL_INSTRUCTION_SETS=x86_64_v3 -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DKSL_PYTHON=ON -DPython_EXECUTABLE=$(CURDIR)/$(BIN)/python \
	  -Dnanobind_DIR=$$($(BIN)/python -m nanobind --cmake_dir))
	test/coverage/run.sh $(CURDIR)/build/coverage $(CURDIR)/$(BIN)/python
	$(BIN)/python test/coverage/gate.py --record coverage build/coverage/exports/*.json
