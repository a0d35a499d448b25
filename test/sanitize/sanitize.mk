# All tests under AddressSanitizer with UndefinedBehaviorSanitizer, those with threads under ThreadSanitizer, those of C and C++ under
# valgrind.  An hour of processor time; each writes its record.

.PHONY: sanitize sanitize-address sanitize-thread sanitize-valgrind
sanitize: sanitize-address sanitize-thread sanitize-valgrind

sanitize-address sanitize-thread sanitize-valgrind: sanitize-%: $(VENV)/.tested
	scripts/system_packages.sh test
	scripts/system_packages.sh trust
	$(BIN)/python test/sanitize/run.py $*
