# Set-up, report, tests. `make` or `make report` is all that a reader needs; `make help` lists the rest.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# What is installed, a stamp each: what the report needs, with the tutorials, and all that tests and documentation need.
REPORT := $(VENV)/.report
TUTORIALS := $(VENV)/.tutorials
ALL := $(VENV)/.all
PIP := $(BIN)/python -m pip --disable-pip-version-check --no-input

# Each process computes with one thread; parallel work is done by processes.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
# Compiled sources are kept, whatever the environment says: hundreds of processes of the tests import them.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := report
.DELETE_ON_ERROR:
.PHONY: report tutorials figures readme picture test test-fast search mutants processors rebuild docs access certificates verify verify-both coq artifact bench bench-report lint format lock clean help

report: $(REPORT) ## recompute what changed, write figures/ and report/index.html (the default)
	$(BIN)/python -m replication run

tutorials: report $(TUTORIALS) ## the tutorials to which the report links, executed, as pages in report/notebooks
	$(BIN)/python -m replication notebooks

figures: report ## the same: figures/ is written with the report

readme: report ## write the results of the run and an example into README.md, with badges
	$(BIN)/python -m benchmarks.readme

picture: report $(ALL) ## take the picture of the README from the report (needs Chromium, and sources that are committed)
	$(BIN)/python -m benchmarks.readme picture

test: lint ## all checks: lint, types, every test
	$(BIN)/python -m pytest --numprocesses=auto --dist=loadfile --no-loadscope-reorder

test-fast: $(ALL) ## the tests that take about a second at most and need no browser
	$(BIN)/python -m pytest -m "not slow and not browser" --numprocesses=auto --dist=loadfile

search: $(ALL) ## new random examples for every generated test; what is found becomes a fixed case
	HYPOTHESIS_PROFILE=search $(BIN)/python -m pytest -m "not browser" $$(grep -rl "from hypothesis import given" tests)

mutants: $(ALL) ## every small change of the verifier and every attack on it, and a sceptic's of library and audit engine (half an hour)
	MUTANTS=all $(BIN)/python -m pytest tests/verify tests/machine tests/sceptic --numprocesses=auto

processors: $(ALL) ## a fresh run on four types of processor; `make test` tries each function of two papers on one other
	PROCESSORS=all $(BIN)/python -m pytest tests/papers/test_processors.py --numprocesses=0

rebuild: $(ALL) ## the archive, unpacked beside nothing but Python and make, builds itself again (five minutes, needs the network)
	REBUILD=all $(BIN)/python -m pytest tests/anywhere/test_journal.py --numprocesses=0

docs: $(ALL) ## the documentation as pages in build/docs, which need no network
	$(BIN)/python -m mkdocs build --quiet

access: $(ALL) ## every page of documentation and tutorials for everyone, of which `make test` looks at some
	PAGES=all $(BIN)/python -m pytest tests/audit/test_site.py

certificates: $(REPORT) ## make the certificates that are wanted and not there, or no longer proved
	$(BIN)/python -m replication certify

verify: $(REPORT) ## check all certificates in exact and ball arithmetic
	$(BIN)/python verify.py

coq: $(REPORT) ## Coq checks the theorems on multi-rate levels (needs coq and libcoq-mathcomp-algebra)
	$(BIN)/python -m replication coq

verify-both: $(REPORT) ## the same in both arithmetics, which share no code and must say the same
	$(BIN)/python verify.py --both

artifact: report ## one zip of sources, lock, results, figures, certificates and report in dist/
	$(BIN)/python -m replication artifact

bench: $(ALL) ## the benchmarks, benchmarks/results.md from their times, and what got slower than on that page
	mkdir -p .benchmarks
	$(BIN)/python -m pytest benchmarks/bench_*.py --benchmark-only --benchmark-json=.benchmarks/latest.json
	-$(BIN)/python -m benchmarks.table .benchmarks/latest.json benchmarks/results.md .benchmarks/results.md
	cp .benchmarks/results.md benchmarks/results.md

bench-report: report $(ALL) ## how fast the report is in Chromium, as it is and with ten times the claims
	$(BIN)/python benchmarks/report_page.py

lint: $(ALL) ## style and types
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

format: $(ALL) ## put the sources into the common form
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

lock: $(ALL) ## write requirements.lock anew from pyproject.toml (needs the network)
	$(BIN)/uv pip compile pyproject.toml --extra estimation --extra proofs --extra dev --extra dask --extra docs --extra notebooks --universal --fork-strategy fewest --generate-hashes \
	  --no-emit-index-url --no-header --quiet -o requirements.lock

clean: ## remove the environment, caches and all that is built; figures/ and results stay
	rm -rf $(VENV) .cache build dist *.egg-info .benchmarks .coverage .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find replication papers tests benchmarks docs -name __pycache__ -type d -prune -exec rm -rf {} +

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

$(REPORT): EXTRAS := estimation proofs
$(TUTORIALS): EXTRAS := estimation proofs notebooks
$(ALL): EXTRAS := estimation proofs notebooks docs dask dev

# First the part of the lock that is needed, with versions and hashes: it is whole, so pip asks no index what else there is (an
# old pip takes `coverage[toml]` of a newer release for another package). Then the project itself, from its own folder.
$(REPORT) $(TUTORIALS) $(ALL): requirements.lock pyproject.toml replication/extras.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo \
	  "Python 3.11 or later is needed, $(PYTHON) is $$($(PYTHON) --version 2>&1); try: make PYTHON=python3.12" >&2; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m replication.extras $(EXTRAS) > $@.lock
	$(PIP) install --quiet --no-deps --require-hashes -r $@.lock
	$(PIP) install --quiet --no-build-isolation --no-deps --config-settings editable_mode=compat --editable .
	touch $@
