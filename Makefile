# Two commands on a fresh Debian 12 (Python 3.11, git, make): `make demo` and `make test`.

SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PAGE := demo-scan/index.html

.PHONY: help demo test lint docs wheels viewer pictures system system-venv system-compiler browser clean
.DEFAULT_GOAL := help

help:
	@echo "make demo     set up, scan the bundled photos, name the page to open"
	@echo "make test     set up everything, run all tests"
	@echo "make lint     ruff, mypy, import floors"
	@echo "make wheels   wheels and source archives of both distributions in dist/"
	@echo "make docs     write the generated parts of docs/"
	@echo "make viewer   build the web viewer into the package (needs node)"
	@echo "make pictures GYM=SCAN SPRAYWALL=SCAN   retake the README's pictures"
	@echo "make system   install the system packages that the two commands want (Debian, root)"

# Debian splits venv from python; containers often come without it.
$(VENV)/pip-ready:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "walltopo needs Python 3.11 or newer: make PYTHON=python3.11 ..."; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || $(MAKE) --no-print-directory system-venv
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/core-ready: $(VENV)/pip-ready pyproject.toml lab/pyproject.toml VERSION constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@command -v c++ >/dev/null || $(MAKE) --no-print-directory system-compiler || true
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[web]' \
	  || echo "no C++ compiler: the page will load slowly; everything else works"
	@touch $@

$(VENV)/dev-ready: $(VENV)/core-ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt \
	  -e '.[dev]' -e './lab[train,tune]'
	@touch $@

demo: $(VENV)/core-ready
	$(BIN)/walltopo scan examples/demo-photos -o demo-scan

test: $(VENV)/dev-ready browser
	$(BIN)/python -m pytest --cov=walltopo --cov-report=term:skip-covered

lint: $(VENV)/dev-ready
	$(BIN)/ruff format --check src lab tests examples conftest.py
	$(BIN)/ruff check src lab tests examples conftest.py
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(VENV)/dev-ready
	COLUMNS=1000 $(BIN)/walltopo settings --markdown > docs/settings.md
	$(BIN)/python -m walltopo.scans.schemas docs/schemas
	WALLTOPO_WRITE_DOCS=1 $(BIN)/python -m pytest tests/scan/test_bad_input.py -k write_the_table

wheels: $(VENV)/dev-ready
	$(BIN)/python -m build --outdir dist .
	$(BIN)/python -m build --outdir dist lab

viewer:
	cd viewer && npm ci --no-audit --no-fund && npm run build

pictures:
	cd viewer && node tests/pictures.mjs --readme $(abspath $(GYM)) $(abspath $(SPRAYWALL))

# The browser tests want Chromium and node; where they cannot be had, those tests skip and say so.
browser:
	@command -v chromium >/dev/null && command -v npm >/dev/null \
	  || $(MAKE) --no-print-directory system \
	  || echo "no browser: the viewer's tests will be skipped"
	@if command -v npm >/dev/null && [ -f viewer/package-lock.json ]; then \
	  [ -d viewer/node_modules ] || (cd viewer && npm ci --no-audit --no-fund --silent) \
	    || echo "npm ci failed: the viewer's tests will be skipped"; fi

SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)

system-venv:
	@echo "installing python3-venv (Debian ships it apart)"
	@command -v apt-get >/dev/null || { echo "install Python's venv module first"; exit 1; }
	$(SUDO) apt-get update -qq && $(SUDO) apt-get install -y -qq python3-venv

system-compiler:
	@echo "installing a C++ compiler (it builds meshoptimizer, which makes the page small)"
	@command -v apt-get >/dev/null || { echo "not a Debian system: install a C++ compiler"; exit 1; }
	$(SUDO) apt-get update -qq && $(SUDO) apt-get install -y -qq g++ python3-dev >/dev/null

system:
	@command -v apt-get >/dev/null || { echo "not a Debian system: install chromium, nodejs, npm"; exit 1; }
	$(SUDO) apt-get update -qq
	@for package in python3-venv python3-dev g++ chromium $$(command -v npm >/dev/null || echo nodejs npm); do \
	  $(SUDO) apt-get install -y -qq $$package >/dev/null || exit 1; done

clean:
	rm -rf $(VENV) demo-scan viewer/node_modules
