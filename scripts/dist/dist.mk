# The wheel as it is published, its source and its list of parts, in build/dist, from pinned packages; the wheel is built twice and compared.
# It is of this machine's processor and Python: PYTHON=python3.12 or later makes the one of the stable ABI.

.PHONY: dist
# another system's, after that: make dist DIST_OPTIONS="--for aarch64-linux-gnu.2.17" (musl, Windows, macOS: scripts/dist/dist.py)
# for developers, a third of the time: make dist DIST_OPTIONS="--sets x86_64_v3"
dist: build/dist-tools/.installed
	build/dist-tools/bin/python scripts/dist/dist.py $(DIST_OPTIONS)

build/dist-tools/.installed: scripts/dist/requirements.txt
	scripts/system_packages.sh demo
	$(PYTHON) -m venv build/dist-tools
	build/dist-tools/bin/python -m pip install -q --require-hashes -r scripts/dist/requirements.txt
	touch $@
