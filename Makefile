# Set-up and the main jobs. Each target sets up .venv by itself when it has to.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
# A diagnosis that the site shows; empty for a site without it.
RECORDED := build/recorded/diagnosis/report.html
ARGS ?=
PYTEST := $(BIN)/python -m pytest -n 2 --dist worksteal
PIP := $(BIN)/python -m pip install --quiet --constraint constraints.txt
# One thread per process: parallel work is done by processes.
export OMP_NUM_THREADS ?= 1

.PHONY: help simulate test test-all test-loaded lint format docs reference results benchmark \
	check-install check-libraries clean
.DEFAULT_GOAL := help

help:  ## Show this list
	@grep -E '^[a-z-]+:.*##' Makefile | sed 's/:.*## /\t/' | expand -t 16

simulate: check-libraries $(VENV)/.run  ## Run the task in Meshcat (ARGS="--policy straight ...")
	$(BIN)/python tools/simulate.py $(ARGS)

test: check-libraries $(VENV)/.dev  ## Run the tests, without the slow proofs
	$(PYTEST) -m "not slow" $(ARGS)

test-all: check-libraries $(VENV)/.dev  ## Run every test
	$(PYTEST) $(ARGS)

test-loaded: check-libraries $(VENV)/.dev  ## Run the tests beside four busy processes
	@for i in 1 2 3 4; do \
	$(BIN)/python -c "while True: pass" & busy="$$busy $$!"; done; \
	trap "kill $$busy" EXIT INT TERM; $(PYTEST) -m "not slow" $(ARGS)

lint: $(VENV)/.dev  ## Check style, types and the rules of the house
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python .ci/lint.py

format: $(VENV)/.dev  ## Put the code in shape
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: check-libraries $(VENV)/.docs $(RECORDED)  ## Build the site: build/docs/index.html
	$(BIN)/python -m sphinx -q -W --keep-going -j auto -d build/doctrees docs build/docs
	@echo "build/docs/index.html"

ifneq ($(RECORDED),)
$(RECORDED): | check-libraries $(VENV)/.docs
	rm -rf $(@D)
	$(BIN)/python docs/_ext/recorded_diagnosis.py $(@D)
endif

reference: check-libraries $(VENV)/.dev  ## Write the pages of docs/reference that the code makes
	$(BIN)/python docs/_ext/reference_pages.py

results: check-libraries $(VENV)/.dev  ## Write docs/results from its data
	$(BIN)/python benchmarks/results_pages.py

benchmark: check-libraries $(VENV)/.dev  ## Measure speed (ARGS="--only cell_reset_ms ...")
	$(BIN)/python benchmarks/benchmark.py $(ARGS)

check-install: check-libraries $(VENV)/.dev  ## Install into an empty environment, import elsewhere
	rm -rf build/empty && $(PYTHON) -m venv build/empty
	build/empty/bin/python -m pip install --quiet --constraint constraints.txt .
	cd / && $(CURDIR)/build/empty/bin/python -c "import gymnasium, sysid; \
	from drake_disasm.stations import make_station; \
	make_station('cell', 'removal'); gymnasium.make('drake_disasm/Removal-v0')"
	cd / && $(CURDIR)/build/empty/bin/drake-disasm simulate --station twin --no-meshcat

clean:  ## Remove what was built
	rm -rf $(VENV) build dist docs/reference/api *.egg-info .mypy_cache .ruff_cache .pytest_cache

$(BIN)/python:
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and \
	'error: Python 3.11 or newer is needed; set PYTHON=python3.11')"
	$(PYTHON) -m venv $(VENV)

# Drake's wheel needs libraries of the system: one line names those that are missing.
check-libraries: | $(BIN)/python
	@$(BIN)/python -I drake_disasm/common/system_libraries.py

$(VENV)/.run: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) --editable .
	@touch $@

$(VENV)/.dev: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) --editable ".[dev]"
	@touch $@ $(VENV)/.run

$(VENV)/.docs: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) --editable ".[docs]"
	@touch $@ $(VENV)/.run
