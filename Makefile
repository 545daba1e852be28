# One environment, .venv, made from requirements.lock; every other target uses it.

PYTHON ?= python3
TEST_WORKERS ?= 2
VENV := .venv
STAMP := $(VENV)/.complete
COMPILED := $(VENV)/.compiled
KERNELS := $(shell grep -rl numba.njit ins_eval --include='*.py')
PIP := $(VENV)/bin/python -m pip --disable-pip-version-check

# The number of BLAS threads decides the last bits of a result, so it is the same everywhere.
export OPENBLAS_NUM_THREADS := 1

RUN_OPTIONS = $(if $(WORKERS),--workers "$(WORKERS)") $(if $(SEED),--seed "$(SEED)")
CLUSTER = $(if $(SCHEDULER),--scheduler "$(SCHEDULER)")

.DEFAULT_GOAL := help
.PHONY: help env flight-report paper-report loop-report check-cep concealed real-report bench bench-check test test-all lint docs wheel lock clean

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-15s %s\n", $$1, $$2 }' Makefile

env: $(COMPILED) ## make .venv from requirements.lock (PYTHON=python3.12 takes another Python)

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

# numba does not see that a function which another file calls has changed, so after a change all is compiled anew.
$(COMPILED): $(STAMP) $(KERNELS)
	@find ins_eval -name '*.nb[ic]' -delete
	@$(VENV)/bin/python -m ins_eval.prepare
	@touch $(COMPILED)

flight-report: env ## how good is this INS? writes reports/flight/ (MODEL=my.py:MyModel PROFILE= INSTRUMENTS= MISSIONS= MISSIONS_FROM= FLIGHTS= STORAGE_YEARS= SEED= WORKERS= SCHEDULER=)
	@$(VENV)/bin/ins-eval flight-report $(if $(MODEL),--model "$(MODEL)") $(if $(PROFILE),--profile "$(PROFILE)") $(if $(STORAGE_YEARS),--storage-years "$(STORAGE_YEARS)") $(if $(INSTRUMENTS),--ensemble "$(INSTRUMENTS)") $(if $(MISSIONS),--missions "$(MISSIONS)") $(if $(MISSIONS_FROM),--missions-from "$(MISSIONS_FROM)") $(if $(FLIGHTS),--flights $(FLIGHTS)) $(RUN_OPTIONS) $(CLUSTER)

paper-report: env ## each number of Paper A beside ours; writes reports/paper-a/ (SEED= WORKERS=)
	@$(VENV)/bin/ins-eval paper-report $(RUN_OPTIONS) $(CLUSTER)

loop-report: env ## each number of Paper B beside ours; writes reports/paper-b/ (SEED= WORKERS=)
	@$(VENV)/bin/ins-eval loop-report $(RUN_OPTIONS)

check-cep: env ## the gate: is hysteresis compensation still better than simple? (SEED= WORKERS=)
	@$(VENV)/bin/ins-eval check-cep $(RUN_OPTIONS) $(CLUSTER)

# Cases of each kind in the sealed set of concealed effects; half of those that hide something have adversarial noise.
SEALED_SEED ?= 3
SEALED := single:205 pair:40 triple:40 four:40 outside:60 unidentifiable:39 null:150 adversarial:150 limited:100 multi:60 elsewhere:40
CONCEALED = .cache/concealed/$(SEALED_SEED)

# Effects in the real recordings of ../shared/recordings; a case is ended after so many seconds of the processor.
REAL_SEED ?= 1
REAL_LIMIT ?= 300
REAL_SET = .cache/concealed/real-$(REAL_SEED)

# Effects in simulated drives and flights of MEMS units.
MEMS_SEED ?= 1
MEMS_COUNT ?= 100
MEMS_SET = .cache/concealed/mems-$(MEMS_SEED)

ifdef QUICK
concealed: env
	@$(VENV)/bin/python -m benchmark.runners.quick --workers $(or $(WORKERS),2) $(if $(SEED),--seed "$(SEED)") $(if $(WITHOUT),--without "$(WITHOUT)")
else ifdef REAL
concealed: env
	@$(VENV)/bin/python -m benchmark.runners.make_real --seed $(REAL_SEED) -o $(REAL_SET)
	@$(VENV)/bin/python -m benchmark.runners.run $(REAL_SET)/recordings $(REAL_SET)/answers --workers $(or $(WORKERS),2) $(CLUSTER) --limit $(REAL_LIMIT)
	@$(VENV)/bin/python -m benchmark.runners.report_real $(REAL_SET) $(REAL_SET)/answers --output reports/concealed-real
else ifdef MEMS
concealed: env
	@$(VENV)/bin/python -m benchmark.runners.make_mems --seed $(MEMS_SEED) --count $(MEMS_COUNT) --workers $(or $(WORKERS),2) -o $(MEMS_SET)
	@$(VENV)/bin/python -m benchmark.runners.run $(MEMS_SET)/recordings $(MEMS_SET)/answers --workers $(or $(WORKERS),2) $(CLUSTER) --limit $(REAL_LIMIT)
	@$(VENV)/bin/python -m benchmark.runners.report_real $(MEMS_SET) $(MEMS_SET)/answers --output reports/concealed-mems
else
concealed: env ## effects concealed in recordings: does diagnose find them? writes reports/concealed/ (SEALED_SEED= WORKERS= QUICK=1: 40 cases in 5 minutes, reports/concealed-quick/ REAL=1: in real ones, reports/concealed-real/ MEMS=1: in drives and flights of MEMS units, reports/concealed-mems/)
	@for each in $(SEALED); do \
	    $(VENV)/bin/python -m benchmark.runners.make --set sealed --seed $(SEALED_SEED) --rate 20 --mixed-noise --kind $${each%:*} \
	        --count $${each#*:} --workers $(or $(WORKERS),2) $(CLUSTER) -o $(CONCEALED) || exit 1; done
	@$(VENV)/bin/python -m benchmark.runners.run $(CONCEALED)/recordings $(CONCEALED)/answers --workers $(or $(WORKERS),2) $(CLUSTER)
	@$(VENV)/bin/python -m benchmark.runners.bound $(CONCEALED) $(CONCEALED)/answers --workers $(or $(WORKERS),2) $(CLUSTER)
	@$(VENV)/bin/python -m benchmark.runners.experiments $(CONCEALED) $(CONCEALED)/answers --workers $(or $(WORKERS),2)
	@$(VENV)/bin/python -m benchmark.runners.navigation $(CONCEALED) $(CONCEALED)/answers --workers $(or $(WORKERS),2) $(CLUSTER)
	@$(VENV)/bin/python -m benchmark.runners.report $(CONCEALED) $(CONCEALED)/answers
endif

real-report: env ## what diagnose says of the real recordings of ../shared/recordings, and what other sources say; writes reports/real/
	@$(VENV)/bin/python -m benchmark.runners.real_report --limit $(REAL_LIMIT)

bench: env ## how fast it is, beside C and python-ins; writes reports/bench/
	@$(VENV)/bin/python -m benchmark.runners.bench

bench-check: env ## the same, and fails where a ratio is worse by more than 25 % than the committed one
	@$(VENV)/bin/python -m benchmark.runners.bench --check

test: lint ## lint, then all tests that are not marked slow
	@$(VENV)/bin/python -m pytest -q -n $(TEST_WORKERS) --dist loadfile --no-loadscope-reorder -m "not slow"

test-all: lint ## lint, then all tests
	@$(VENV)/bin/python -m pytest -q -n $(TEST_WORKERS) --dist loadfile --no-loadscope-reorder

lint: env ## import directions, style and types
	@$(VENV)/bin/lint-imports --no-logo
	@$(VENV)/bin/ruff check
	@$(VENV)/bin/mypy --cache-dir .cache/mypy

docs: env ## these pages as a site; writes reports/docs/
	@$(VENV)/bin/python -m sphinx -q -W --keep-going -b html docs reports/docs

wheel: env ## build wheel and sdist into dist/
	@$(VENV)/bin/python -m hatchling build --directory dist

lock: ## remake requirements.lock (maintainers; needs uv)
	uv pip compile pyproject.toml --extra formats --extra docs --group dev --universal --python-version 3.11 --generate-hashes --no-header -o requirements.lock

clean: ## remove results, wheels and caches; .venv stays
	@find reports -mindepth 1 -maxdepth 1 ! -name README.md ! -name concealed -exec rm -rf {} +
	@find reports/concealed -mindepth 1 ! -name log.json -delete 2>/dev/null || true
	@rm -rf .cache dist .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	@find ins_eval benchmark tests -name __pycache__ -type d -prune -exec rm -rf {} +
