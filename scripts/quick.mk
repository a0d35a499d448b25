# make quick NAME=inverse_dynamics   after a change of an algorithm: its kernel, and the tests in C++ and the laws that name it (scripts/quick.py).  The
#                                    first run builds everything once.
# make test-environment              what editors and hooks use: packages, .venv with the tools, the commands of all units
.PHONY: quick test-environment
QUICK_PACKAGES := pytest pytest-xdist hypothesis mpmath gmpy2 ruff mypy

quick: $(VENV)/.quick
	$(BIN)/python scripts/quick.py $(NAME)

test-environment: $(VENV)/.quick
	$(FORMAT_TOOL)
	$(BIN)/python scripts/quick.py --configure

$(VENV)/.quick: $(VENV)/.packages scripts/quick.mk
	$(BIN)/python -m pip install -q $(QUICK_PACKAGES)
	touch $@
