# Kills, interrupts and starves every command that writes.  The tests of `make test` in this folder do a part of it.

.PHONY: test-faults
# 100 random moments and each change of a folder; disks of 20 sizes where they can be mounted.  About a quarter of an hour; writes its record.
test-faults: $(VENV)/.tested
	KSL_LIBRARY=$(CURDIR)/build/clang/libksl.so $(BIN)/python test/faults/kill_at_random.py
