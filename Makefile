# Every target sets up what it needs: `make demo` in a fresh clone is enough.

.DEFAULT_GOAL := help
SHELL := /bin/bash
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
TOOLS := $(VENV)/.tools
COMPARED := $(VENV)/.compared
WRITING := $(VENV)/.writing
NOTEBOOKS := $(VENV)/.notebooks

# The first interpreter that runs and is new enough (a pyenv shim may exist and not run).
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$p; break; }; done)

.PHONY: help setup demo test nightly check docs notebooks bench serve lock clean

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: $(TOOLS) ## Create .venv with the locked versions and joulepath in it

# What runs and installs joulepath; the demonstration needs no more.
$(READY): pyproject.toml requirements/lock.txt requirements/build.txt
	@test -n "$(PYTHON)" || { echo "joulepath needs Python 3.11 or newer, and none was found. On Debian or Ubuntu: apt-get install python3 python3-venv"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "$(PYTHON) cannot make a virtual environment (ensurepip is missing). On Debian or Ubuntu: apt-get install python3-venv"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/lock.txt -r requirements/build.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	$(BIN)/python -m service.compiling
	@touch $(READY)

# What joulepath is developed with, and the optional readers of logs.
$(TOOLS): requirements/dev.txt | $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/dev.txt
	@touch $(TOOLS)

demo: $(READY) ## Plan on real relief, then find out what a robot hides; writes demo/
	$(BIN)/python -m service.demo

test: $(TOOLS) ## Run the tests
	$(BIN)/python -m pytest -n 2 --dist loadfile -m "not bench and not nightly" tests

nightly: $(TOOLS) ## Run the slow tests: long pages, notebooks, every planner on every space
	$(BIN)/python -m pytest -n 2 --dist worksteal -m nightly tests

check: $(TOOLS) ## Style, types, layers, documentation
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(BIN)/interrogate --quiet planner service maps
	$(BIN)/hadolint Dockerfile
	$(BIN)/codespell
	$(BIN)/python -m pytest -q tests/test_documented.py tests/test_rooms.py

docs: $(TOOLS) $(WRITING) ## Build the documents and the API reference as a site in site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

$(WRITING): requirements/docs.txt | $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/docs.txt
	@touch $(WRITING)

notebooks: $(TOOLS) $(NOTEBOOKS) ## Execute docs/notebooks, outputs included
	$(BIN)/python -m docs.run_notebooks

$(NOTEBOOKS): requirements/notebooks.txt | $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/notebooks.txt
	@touch $(NOTEBOOKS)

bench: $(TOOLS) $(COMPARED) ## Measure speed, route quality, naming of hidden effects
	$(BIN)/python -m tests.benchmarks

$(COMPARED): requirements/bench.txt | $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/bench.txt
	@touch $(COMPARED)

serve: $(TOOLS) ## Serve HTTP and the page on 127.0.0.1:8000
	$(BIN)/joulepath serve

COMPILE := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
	--no-header --no-emit-index-url --no-emit-find-links --upgrade

lock: $(READY) ## Resolve the newest versions again and lock them with hashes
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	$(COMPILE) pyproject.toml -o requirements/lock.txt
	$(COMPILE) pyproject.toml --extra dev -c requirements/lock.txt -o requirements/dev.txt
	$(COMPILE) pyproject.toml --extra bench -c requirements/dev.txt -o requirements/bench.txt
	$(COMPILE) pyproject.toml --extra docs -c requirements/dev.txt -o requirements/docs.txt
	$(COMPILE) pyproject.toml --extra notebooks -c requirements/dev.txt -o requirements/notebooks.txt
	printf "hatchling>=1.27\neditables>=0.5\n" | $(COMPILE) - -c requirements/dev.txt -o requirements/build.txt

clean: ## Remove what the targets make, the virtual environment included
	rm -rf $(VENV) build dist demo site .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
