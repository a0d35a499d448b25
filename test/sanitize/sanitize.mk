# All tests under AddressSanitizer with UndefinedBehaviorSanitizer, those with threads under ThreadSanitizer, those of C and C++ and of
# the module's interface under valgrind.  Some hours of processor time; each writes its record.

.PHONY: sanitize sanitize-address sanitize-thread sanitize-valgrind sanitize-valgrind-python
sanitize: sanitize-address sanitize-thread sanitize-valgrind sanitize-valgrind-python

sanitize-address sanitize-thread sanitize-valgrind sanitize-valgrind-python: sanitize-%: $(VENV)/.tested
	scripts/system_packages.sh test
	scripts/system_packages.sh trust
	$(BIN)/python test/sanitize/run.py $*
