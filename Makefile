# Two commands for a newcomer: `make train` and `make test`. Both set up .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
RUN ?= runs/paper

.PHONY: help setup train test lint golden clean

help:
	@echo "make setup   create .venv and install pinned dependencies (does nothing when nothing changed)"
	@echo "make train   learn the paper's insertion, 350 trials; the result is left in $(RUN)"
	@echo "make test    style, types, layering and all tests"
	@echo "make lint    style, types and layering only"
	@echo "make golden  record the logs in tests/golden anew, after a change that is meant to change behaviour"

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "palpate needs Python 3.11 or newer, this is " + sys.version.split()[0])'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

train: setup
	$(BIN)/palpate train --scenario paper --out $(RUN)

lint: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: lint
	$(BIN)/pytest -n 2 --dist loadgroup

golden: setup
	$(BIN)/python tests/golden/record.py

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
