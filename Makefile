# One environment, .venv, made from requirements.lock; every other target uses it.

PYTHON ?= python3
TEST_WORKERS ?= 2
VENV := .venv
STAMP := $(VENV)/.complete
PIP := $(VENV)/bin/python -m pip --disable-pip-version-check

# The number of BLAS threads decides the last bits of a result, so it is the same everywhere.
export OPENBLAS_NUM_THREADS := 1

RUN_OPTIONS = $(if $(WORKERS),--workers "$(WORKERS)") $(if $(SEED),--seed "$(SEED)")

.DEFAULT_GOAL := help
.PHONY: help env flight-report paper-report check-cep test test-all lint wheel lock clean

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-15s %s\n", $$1, $$2 }' Makefile

env: $(STAMP) ## make .venv from requirements.lock (PYTHON=python3.12 takes another Python)

# Without its stamp the environment is unfinished, whatever lies there, and is made from nothing.
$(STAMP): pyproject.toml requirements.lock
	@if [ ! -e $(STAMP) ]; then \
	    $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	        echo "make env: ins_eval needs Python 3.11 or newer, but $(PYTHON) is" \
	             "'$$($(PYTHON) --version 2>&1)'; name another one: make env PYTHON=python3.12" >&2; exit 1; }; \
	    $(PYTHON) -m venv --clear $(VENV) || { \
	        echo "make env: $(PYTHON) cannot make a virtual environment; on Debian and Ubuntu:" \
	             "apt install python3-venv" >&2; exit 1; }; \
	fi
	@rm -f $(STAMP)
	@echo "make env: installing the locked packages into $(VENV), about a minute"
	@$(PIP) install --quiet --require-hashes -r requirements.lock
	@$(PIP) install --quiet --no-deps --no-build-isolation -e .
	@touch $(STAMP)

flight-report: env ## how good is this INS? writes reports/flight/ (MODEL=my.py:MyModel PROFILE= SEED= WORKERS=)
	@$(VENV)/bin/ins-eval flight-report $(if $(MODEL),--model "$(MODEL)") $(if $(PROFILE),--profile "$(PROFILE)") $(RUN_OPTIONS)

paper-report: env ## each number of Paper A beside ours; writes reports/paper-a/ (SEED= WORKERS=)
	@$(VENV)/bin/ins-eval paper-report $(RUN_OPTIONS)

check-cep: env ## the gate: is hysteresis compensation still better than simple? (SEED= WORKERS=)
	@$(VENV)/bin/ins-eval check-cep $(RUN_OPTIONS)

test: lint ## lint, then all tests that are not marked slow
	@$(VENV)/bin/python -m pytest -q -n $(TEST_WORKERS) --dist loadfile -m "not slow"

test-all: lint ## lint, then all tests
	@$(VENV)/bin/python -m pytest -q -n $(TEST_WORKERS) --dist loadfile

lint: env ## import directions and style
	@$(VENV)/bin/lint-imports --no-logo
	@$(VENV)/bin/ruff check

wheel: env ## build the wheel into dist/
	@$(PIP) wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

lock: ## remake requirements.lock (maintainers; needs uv)
	uv pip compile pyproject.toml --group dev --universal --python-version 3.11 --generate-hashes --no-header -o requirements.lock

clean: ## remove results, wheels and caches; .venv stays
	@find reports -mindepth 1 -maxdepth 1 ! -name README.md -exec rm -rf {} +
	@rm -rf dist .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	@find ins_eval tests -name __pycache__ -type d -prune -exec rm -rf {} +
