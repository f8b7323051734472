# Two commands for a newcomer: `make train` and `make test`. Both set up .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
RUN ?= runs/paper
BENCH ?= runs/bench.json

# PyPI's torch for Linux installs gigabytes of CUDA, which nothing here uses.
TORCH_CPU ?= https://download.pytorch.org/whl/cpu
TORCH := $(shell grep '^torch==' constraints.txt)
QUIET := --quiet --disable-pip-version-check

.PHONY: help setup train test test-fast suite nightly coverage lint style types docs docs-setup golden bench bench-full ros2-check count clean

help:
	@echo "make setup   create .venv and install pinned dependencies (does nothing when nothing changed)"
	@echo "make train   learn the paper's insertion, 350 trials, or go on with it; the result is left in $(RUN)"
	@echo "make test    style, types, layering and all tests"
	@echo "make test-fast  tests of the packages alone, under a minute"
	@echo "make nightly what takes longer: learning curves, random parts, mutants, fuzzing, other versions; under an hour, resumable"
	@echo "make coverage   lines and branches that the tests run, by package"
	@echo "make lint    style, words, types and layering only"
	@echo "make docs    the documentation site in runs/site/html, strictly: a lost link or any other warning is an error"
	@echo "make bench   costs of the framework next to their floors, under three minutes; figures also in $(BENCH)"
	@echo "make bench-full  the same over 350 trials"
	@echo "make ros2-check  the ROS 2 adapters against the real rclpy of Kilted and Jazzy, from PyPI"
	@echo "make count   lines of source, tests and benchmarks, words of documents"
	@echo "make golden  record the logs in tests/golden again, after a change that is meant to alter behaviour"

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "palpate needs Python 3.11 or newer, this is " + sys.version.split()[0])'
	$(PYTHON) -m venv $(VENV)
	@$(BIN)/pip install $(QUIET) uv || echo "uv cannot be had; pip installs, more slowly"
	@[ "$$(uname -s)" != Linux ] || UV_HTTP_TIMEOUT=10 $(BIN)/python -m uv pip install --quiet --no-deps --index $(TORCH_CPU) "$(TORCH)" 2>/dev/null \
		|| $(BIN)/pip install $(QUIET) --no-deps "$(TORCH)"
	@if $(BIN)/python -c 'import uv' 2>/dev/null; \
	then $(BIN)/python -m uv pip install --quiet --python $(BIN)/python -c constraints.txt -e '.[dev]'; \
	else $(BIN)/pip install $(QUIET) -c constraints.txt -e '.[dev]'; fi
	@touch $@

train: setup
	@if [ -e $(RUN)/checkpoint.json ]; then \
		echo "$(RUN) holds a training: going on with it; for another one: make train RUN=runs/another"; \
		$(BIN)/palpate train --resume --out $(RUN); \
	else \
		$(BIN)/palpate train --scenario paper --out $(RUN); \
	fi

lint: style types

style: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	$(BIN)/python -m docs.site.vocabulary
	$(BIN)/python -m docs.site.vocabulary --source

types: setup
	$(BIN)/mypy

# What waits for real time runs by itself afterwards: beside busy workers its devices would come late.
# Bytecode is kept, also where the environment says not to: each process that a test starts would compile all anew.
test: export PYTHONDONTWRITEBYTECODE :=
# One worker per processor; threads of their libraries would only wait for each other.
test: export OMP_NUM_THREADS := 1
# Types are checked beside the tests: neither keeps two processors busy all the time.
test: style
	$(MAKE) --no-print-directory --jobs 2 types suite
	$(BIN)/pytest -n 2 --dist loadgroup tests/wall_clock

suite: setup
	$(BIN)/pytest -n 2 --dist loadgroup --ignore tests/wall_clock --ignore tests/documents

# Without whole commands, devices' processes and pictures.
test-fast: setup
	$(BIN)/pytest -q -n 2 tests/unit/core tests/unit/drivers tests/unit/simulation tests/golden

# On the day's seed; what passed is not run again for the same commit.
nightly: setup
	$(BIN)/python -m benchmarks.nightly

coverage: setup
	$(BIN)/pytest -q -n 2 --dist loadgroup --ignore tests/wall_clock --ignore tests/documents --cov=palpate --cov-branch --cov-report=json:runs/coverage.json
	$(BIN)/python -m benchmarks.covered runs/coverage.json --least 90

# Under a minute; its builder is an extra of its own, which neither training nor tests need.
docs-setup: setup
	$(BIN)/python -c 'import zensical, mkdocstrings' 2>/dev/null \
		|| $(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[docs]'

# The commands that the pages show run too, with fewer trials; make test only looks whether their options are there.
docs: docs-setup
	$(BIN)/python -m docs.site.build
	$(BIN)/pytest -n 2 tests/documents

golden: setup
	$(BIN)/python -m tests.golden.record

# An otherwise idle machine, please: ratios bear some other work, times do not.
bench: setup
	$(BIN)/python -m benchmarks.suite --quick --json $(BENCH)

bench-full: setup
	$(BIN)/python -m benchmarks.suite --json $(BENCH)

# Nothing of ROS need be installed: its client library comes as wheels, for Python 3.11.
PEERS := runs/ros2-peers

ros2-check: setup
	@for peer in kilted:ros- jazzy:ros-jazzy-; do \
		folder=$(PEERS)/$${peer%%:*}; name=$${peer##*:}; \
		[ -e $$folder/installed ] || { $(PYTHON) -m venv $$folder && $$folder/bin/pip install $(QUIET) \
			"$${name}rclpy[fastrtps]" $${name}rmw-fastrtps-cpp $${name}sensor-msgs $${name}geometry-msgs $${name}std-msgs \
			2>/dev/null && touch $$folder/installed; } \
		|| echo "ros2-check: the wheels of $${name}rclpy cannot be had; $${peer%%:*} is skipped"; \
	done
	$(BIN)/pytest -n 0 tests/peers

# What a reader has to read: lines of Python by source root, words of documents, golden logs.
count:
	@lines() { git ls-files -- "$$@" | grep '\.py$$' | tr '\n' '\0' | xargs -0 -r cat | wc -l; }; \
	for root in core adapters drivers simulation tests benchmarks examples; do printf '%-12s %6d lines\n' $$root $$(lines $$root); done; \
	printf '%-12s %6d lines\n' source $$(lines core adapters drivers simulation)
	@printf '%-12s %6d words\n' documents $$(git ls-files -- '*.md' | grep -vE '^(examples|tests)/' | tr '\n' '\0' | xargs -0 -r cat | wc -w)
	@printf '%-12s %6d files\n' 'golden logs' $$(git ls-files -- 'tests/golden/*.mcap' | wc -l)

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
