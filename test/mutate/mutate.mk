# make mutate        plants every sign, index and operator mutant into algebra and engine, loaders and batches, and into the rooms of Python whose
#                    numbers users take, one at a time, and runs the tests that reach it; writes test/mutate/results.md and the record of the
#                    promise.  Several hours on two idle cores.  MUTATED="sizing load" takes these alone, and writes nothing.
# make mutate-sample a random twentieth of them, and the list of those that no test noticed; writes nothing
.PHONY: mutate mutate-sample

MUTATE_RUN = $(BIN)/python test/mutate/run.py

MUTATE_SCOPES = algebra engine load batch sizing load_cases motions sweeps checks mechanism simulation model robot_files comparison generation drivetrain \
  small_motions parts

mutate: build/mutate/.libraries
	$(MUTATE_RUN) $(or $(MUTATED),$(MUTATE_SCOPES)) --list $(if $(MUTATED),,--write)

mutate-sample: build/mutate/.libraries
	$(MUTATE_RUN) $(or $(MUTATED),$(MUTATE_SCOPES)) --fraction 0.05 --list

build/mutate/.libraries: test/mutate/requirements.txt $(VENV)/.tested
	$(BIN)/pip install -q -r $<
	mkdir -p $(@D) && touch $@
