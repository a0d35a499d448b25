# The wheel, its source and its list of parts, in build/dist, from pinned packages; the wheel is built twice and compared.

.PHONY: dist
# for developers, a third of the time: make dist DIST_OPTIONS="--sets x86_64_v3"
dist: build/dist-tools/.installed
	build/dist-tools/bin/python scripts/dist/dist.py $(DIST_OPTIONS)

build/dist-tools/.installed: scripts/dist/requirements.txt
	scripts/system_packages.sh demo
	$(PYTHON) -m venv build/dist-tools
	build/dist-tools/bin/python -m pip install -q --require-hashes -r scripts/dist/requirements.txt
	touch $@
