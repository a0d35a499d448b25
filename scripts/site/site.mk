# The documentation as a site, in build/site, from pinned packages; nothing is compiled.  Links that lead nowhere, and pages in no list, are errors.

.PHONY: site
site: build/site-tools/.installed
	build/site-tools/bin/python scripts/site/build.py $(SITE_OPTIONS)

build/site-tools/.installed: scripts/site/requirements.txt
	$(PYTHON) -m venv build/site-tools
	build/site-tools/bin/python -m pip install -q --require-hashes -r scripts/site/requirements.txt
	touch $@
