# What compilers and analysers say of C, C++ and Python, each as an error; that each of them finds a fault; and the record.  What is chosen,
# and why: scripts/lint/warning_options.py, .clang-tidy, scripts/lint/cppcheck.txt, pyproject.toml.
#
# To take about 4 minutes of two cores, clang-tidy reads one group of kernels, the derivatives, and gcc reads public headers
# in C++ as parts of units, not alone.  `make lint LINT_OPTIONS=--all` reads everything.

.PHONY: lint
lint: $(VENV)/.tested
	scripts/system_packages.sh lint
	scripts/system_packages.sh test
	$(BIN)/python -c 'import ruff' 2>/dev/null || $(BIN)/python -m pip install -q 'ruff>=0.15'
	$(BIN)/python scripts/lint/lint.py --record $(LINT_OPTIONS)
