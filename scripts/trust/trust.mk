# The page of promises.  Long checks have targets of their own; each writes its record.

.PHONY: trust
# Runs the tests that promises name in the builds of `make test`, records the results, and writes docs/trust.md.
trust: $(VENV)/.tested test-c
	$(BIN)/python -c 'import pinocchio' 2>/dev/null || $(BIN)/python -m pip install -q 'pin>=3'
	status=0; KSL_LIBRARY=$(CURDIR)/build/clang/libksl.so $(BIN)/python scripts/trust/prove.py build/gcc build/clang || status=1; \
	$(BIN)/python scripts/trust/page.py && exit $$status
