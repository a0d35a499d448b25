# The C interface against that of the last release (API_CHANGES.md).  ABI_OPTIONS=--record writes the record.

.PHONY: abi abi-release
abi:
	scripts/system_packages.sh abi
	$(PYTHON) scripts/abi/abi.py compare $(ABI_OPTIONS)

# Part of a release, and of a change of the interface before the first one.
abi-release:
	scripts/system_packages.sh abi
	$(PYTHON) scripts/abi/abi.py release
