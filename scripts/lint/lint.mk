# What compilers and analysers say of C, C++ and Python, each as an error, and whether files are formatted; that each of them finds a fault.  What is
# chosen, and why: cmake/warnings.txt, .clang-tidy, scripts/lint/cppcheck.txt, .clang-format, pyproject.toml.
#
# The builds of `make test` have all warnings of cmake/warnings.txt as errors.  So what they compile is not read again.  clang-tidy, and the compilers
# where no build does it, read what has changed since the last record.  `make lint LINT_OPTIONS=--all` reads everything and writes the record,
# LINT_OPTIONS=--record writes it, too.

FORMAT_TOOL = $(BIN)/python scripts/format.py --version >/dev/null 2>&1 || $(BIN)/python -m pip install -q $$(sed -n 's/^VERSION = "\(.*\)"/clang-format==\1/p' scripts/format.py)
RUFF = $(BIN)/python -c 'import ruff' 2>/dev/null || $(BIN)/python -m pip install -q 'ruff>=0.15'

.PHONY: lint lint-alone lint-tools format
lint: build-gcc build-clang
	$(MAKE) --no-print-directory lint-alone

lint-alone: lint-tools
	$(BIN)/python scripts/lint/lint.py --built build/gcc --built build/clang $(LINT_OPTIONS)

lint-tools: $(VENV)/.tested
	scripts/system_packages.sh lint test
	$(RUFF)
	$(FORMAT_TOOL)

# C and C++ as .clang-format says, Python as pyproject.toml does.
format: $(VENV)/.tools
	$(FORMAT_TOOL)
	$(BIN)/python scripts/format.py
	$(RUFF)
	$(BIN)/python -m ruff format --quiet python scripts test bench examples docs fuzz
