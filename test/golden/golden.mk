# Golden hashes: the same bits with every compiler, level of optimisation and instruction set.
# make golden: gcc and clang, -O0 to -O3, x86-64-v2 to v4 and NEON under emulation.  The engine is compiled anew for each: hours.
# make golden-algebra: the C algebra alone, minutes.  make golden-update: writes the table from one build, where results were meant to change.
.PHONY: golden golden-algebra golden-update
GOLDEN := $(if $(wildcard $(VENV)/bin/python),$(VENV)/bin/python,python3) test/golden/golden.py

golden:
	scripts/system_packages.sh trust
	$(GOLDEN) --record
golden-algebra:
	$(GOLDEN) --parts algebra
golden-update:
	$(GOLDEN) --update --compilers gcc --levels 0 --sets x86-64-v2
