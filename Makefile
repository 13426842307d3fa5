.PHONY: help setup demo test check bench soak lint types openapi clean
.DEFAULT_GOAL := help
PYTHON ?= python3
BIN := .venv/bin

help: ## what can be made
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/'

setup: .venv/.installed ## install everything into .venv, from locked and hashed requirements

.venv/.installed: requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed, this is " + sys.version)'
	@bash .ci/system-packages run
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@echo "compiling (once; the first design need not)"
	@data=$$(mktemp -d) && GRIPWRIGHT_DATA=$$data $(BIN)/gripwright design service/gripwright/samples/pump --out $$data/design > $$data/log; rm -r $$data
	@touch $@

demo: setup ## the sample product through the real service, down to the bill of materials
	$(BIN)/gripwright demo

test: setup ## every test; installs Chromium and PostgreSQL from Debian where it may
	@bash .ci/system-packages test
	$(BIN)/python -m pytest -n 2 --no-loadscope-reorder

check: lint types test ## lint, types, import rules, OpenAPI unchanged, tests

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	PYTHONPATH=plugins/gripwright_vacuum/src $(BIN)/lint-imports

types: setup
	$(BIN)/mypy

openapi: setup ## write the OpenAPI document after the interface changed
	$(BIN)/gripwright openapi > openapi/openapi.json

bench: setup ## measure against the yardsticks
	$(BIN)/python -m tests.benchmarks

soak: setup ## the long tests: load, faults, hostile input, requests and assemblies that are made up
	@bash .ci/system-packages test
	$(BIN)/python -m tests.soak

clean:
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis
