# make mutate        plants every sign, index and operator mutant into algebra and engine, one at a time, and runs the tests that reach it;
#                    writes test/mutate/results.md and the record of the promise.  An hour or more on two idle cores.
# make mutate-sample a random twentieth of them, and the list of those that no test noticed; writes nothing
.PHONY: mutate mutate-sample

MUTATE_RUN = $(BIN)/python test/mutate/run.py

mutate: build/mutate/.libraries
	$(MUTATE_RUN) algebra engine --list --write

mutate-sample: build/mutate/.libraries
	$(MUTATE_RUN) algebra engine --fraction 0.05 --list

build/mutate/.libraries: test/mutate/requirements.txt $(VENV)/.tested
	$(BIN)/pip install -q -r $<
	mkdir -p $(@D) && touch $@
