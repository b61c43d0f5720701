# On a fresh Debian 12 (Python 3.11, git, make): `make demo`, `make gym`, `make test`.

SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DEMO ?= demo-scan
# Training goes on for days: its state lies outside of the checkout, on one processor core.
TRAIN_DIR ?= $(or $(WALLTOPO_CACHE),$(or $(XDG_CACHE_HOME),$(HOME)/.cache)/walltopo)/train
TRAIN_CORE ?= 0
DATA ?= ../shared/data
# Memory that a step frees stays with the process, or each step pays for its pages again (a tenth of its time).
TRAIN_ENV := OMP_NUM_THREADS=1 MALLOC_MMAP_THRESHOLD_=4000000000 MALLOC_TRIM_THRESHOLD_=8000000000 MALLOC_TOP_PAD_=268435456
# Processes that the tests run in: more than two cores, because browsers and servers wait much. 0: in this one.
WORKERS ?= 3

.PHONY: help web demo gym dev test test-all coverage docs-check count audit test-ultralytics test-pythons lint docs site wheels sbom npm-package clients sums sign release-check containers film moves-film viewer app pictures system system-venv system-compiler browser database clean train train-export train-quantize
.DEFAULT_GOAL := help

help:
	@echo "make demo     set up, scan the bundled photos, name the page to open"
	@echo "make gym      set up, scan the bundled photos into a demo gym, serve it, name address and accounts"
	@echo "make dev      the same demo gym for developers: it follows each change of a source"
	@echo "make test     set up everything, run the quick tests (minutes)"
	@echo "make test-all the same, and the slow tests: PostgreSQL, browsers, kills, wheels"
	@echo "make coverage all tests, with the share of the lines that they run"
	@echo "make test-ultralytics   the tests that need Ultralytics (AGPL-3.0), in an environment of its own"
	@echo "make test-pythons       the quick tests on Python 3.12 and 3.13, where they are installed"
	@echo "make train    train the shipped detector on one core until it is stopped; goes on where it stopped"
	@echo "make train-export   export what it learnt, compare it with the shipped network (EXPORT=--replace)"
	@echo "make train-quantize   quantize the shipped network, compare the two (EXPORT=--replace)"
	@echo "make lint     ruff, mypy, import floors"
	@echo "make docs-check   pages against the code, the tests and the records"
	@echo "make count    lines of code and files of each package"
	@echo "make wheels   wheels and source archives of all distributions in dist/"
	@echo "make site     build the documentation as static files in site/"
	@echo "make clients  the clients of a gym's API, an npm package and a wheel, in dist/"
	@echo "make sbom     what the packages are made of (CycloneDX) and their licences in dist/"
	@echo "make release-check   make everything that a release publishes, install it into empty environments, upgrade old data"
	@echo "make containers   build the containers' image from Debian's packages and play a gym's day in it (Debian, root)"
	@echo "make docs     write the generated parts of docs/"
	@echo "make audit    known weaknesses of the dependencies (needs the network)"
	@echo "make viewer   build the web viewer, if its sources have changed (demo, gym and test do)"
	@echo "make app      build and check the platform's web app, with the types of the API"
	@echo "make pictures GYM=SCAN SPRAYWALL=SCAN DEMO=SCAN   retake the pictures of README and tutorial"
	@echo "make film DEMO=SCAN   make the README's film anew"
	@echo "make moves-film DEMO=SCAN ROUTE=ID   make the film of docs/grades.md anew"
	@echo "make system   install the system packages that the two commands want (Debian, root)"

# Debian splits venv from python; containers often come without it.
$(VENV)/pip-ready:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "walltopo needs Python 3.11 or newer: make PYTHON=python3.11 ..."; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || $(MAKE) --no-print-directory system-venv
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/core-ready: $(VENV)/pip-ready pyproject.toml features/pyproject.toml climb/pyproject.toml lab/pyproject.toml gym/pyproject.toml VERSION constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e . -e ./climb
	@command -v c++ >/dev/null || $(MAKE) --no-print-directory system-compiler || true
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[web]' \
	  || echo "no C++ compiler: the page will load slowly; everything else works"
	@touch $@

$(VENV)/dev-ready: $(VENV)/core-ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt \
	  -e '.[dev]' -e ./features -e ./climb -e './lab[train,tune,dev]' -e './gym[dev]'
	@touch $@

$(VENV)/release-ready: $(VENV)/dev-ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[release]'
	@touch $@

# The web pages, where they are missing or older than their sources.
viewer: $(VENV)/pip-ready
	@$(BIN)/python tools/web_build.py viewer

web: $(VENV)/pip-ready
	@$(BIN)/python tools/web_build.py viewer app

demo: $(VENV)/core-ready viewer
	$(BIN)/walltopo scan examples/demo-photos -o demo-scan

# For work on the platform: the server starts again, and the page changes, with each change of a source.
dev: $(VENV)/dev-ready web
	$(BIN)/python tools/dev.py

# The gym is kept in demo-gym: the second start takes seconds.
gym: $(VENV)/core-ready web
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ./climb -e ./gym
	$(BIN)/walltopo gym demo --data demo-gym

test: $(VENV)/dev-ready web browser database
	$(BIN)/python run_tests.py quick --workers $(WORKERS)

test-all: $(VENV)/dev-ready web browser database
	$(BIN)/python run_tests.py all --workers $(WORKERS)

# The tests take a good deal longer while their lines are counted.
coverage: $(VENV)/dev-ready web browser database
	$(BIN)/python run_tests.py all --workers $(WORKERS) --cov=walltopo --cov=walltopo_gym --cov-report=term:skip-covered

# Ultralytics is AGPL-3.0, so it is no part of `make test`.
test-ultralytics: $(VENV)/dev-ready
	$(PYTHON) -m venv $(VENV)-ultralytics
	$(VENV)-ultralytics/bin/python -m pip install --quiet --disable-pip-version-check -e '.[dev]' -e ./climb -e './lab[train,tune,ultralytics]'
	$(VENV)-ultralytics/bin/python -m pytest lab/tests -m ultralytics

# The quick tests of the product on each newer Python that is here and that the wheels exist for.
test-pythons:
	@for version in 3.12 3.13; do \
	  command -v python$$version >/dev/null && python$$version -c '' 2>/dev/null \
	    || { echo "no python$$version here: not tested"; continue; }; \
	  python$$version -m venv $(VENV)-$$version \
	    && $(VENV)-$$version/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]' -e ./climb -e ./lab \
	    && $(VENV)-$$version/bin/python -m pytest tests/core tests/geometry tests/images tests/scans tests/reconstruct/ingest tests/segment/lift \
	         tests/describe tests/cli \
	         --deselect tests/scans/test_scans_schemas.py::test_what_a_scan_writes_is_valid \
	    || exit 1; \
	done

# The caches lie in the environment, so that the next check of a cleaned checkout has them; one for each system,
# because another system's results would replace those of this one.
lint: $(VENV)/dev-ready
	$(BIN)/ruff format --check src features climb lab gym tests benchmarks tools viewer/*.py examples conftest.py run_tests.py
	$(BIN)/ruff check src features climb lab gym tests benchmarks tools viewer/*.py examples conftest.py run_tests.py
	$(BIN)/mypy --cache-dir $(VENV)/mypy
	for system in win32 darwin; do \
	  $(BIN)/mypy --cache-dir $(VENV)/mypy-$$system --platform $$system src climb/src || exit 1; done
	$(BIN)/lint-imports

docs-check: $(VENV)/dev-ready
	$(BIN)/python -m tools.pages.docs_check

count: $(VENV)/dev-ready
	$(BIN)/python -m tools.code_size src/walltopo

docs: $(VENV)/dev-ready
	COLUMNS=1000 $(BIN)/walltopo settings --markdown > docs/settings.md
	$(BIN)/python -m walltopo.scans.schemas docs/schemas
	$(BIN)/python viewer/wire_types.py
	$(BIN)/python viewer/colour_vision.py
	$(BIN)/python -m tools.tests.bad_input.page > docs/bad-input.md
	$(BIN)/python -m tools.pages.figures

# Broken links are errors; tools/tests/pages/test_site.py builds it too, and looks at what came out.
site: $(VENV)/dev-ready viewer
	$(BIN)/python -m tools.pages.staging build/site
	$(BIN)/zensical build --strict

wheels: $(VENV)/dev-ready
	$(BIN)/python -m build --outdir dist .
	$(BIN)/python -m tools.compiled_wheel dist/walltopo-$$(cat VERSION)-py3-none-any.whl
	$(BIN)/python -m build --outdir dist features
	$(BIN)/python -m build --outdir dist climb
	$(BIN)/python -m build --outdir dist lab
	$(BIN)/python -m build --outdir dist gym

# What the product and the platform are made of: CycloneDX, and a list of licences to read.
sbom: $(VENV)/release-ready
	rm -rf build/released && $(PYTHON) -m venv build/released && mkdir -p dist
	build/released/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt . ./climb ./gym
	build/released/bin/python -m pip uninstall --quiet -y pip setuptools
	$(BIN)/cyclonedx-py environment build/released --output-file dist/walltopo-$$(cat VERSION).cdx.json
	$(BIN)/pip-licenses --python build/released/bin/python --format markdown --with-urls \
	  --output-file dist/licences.md
	cd viewer && npm sbom --package-lock-only --omit dev --sbom-format cyclonedx > ../dist/wall-topo-$$(cat ../VERSION).cdx.json

sums:
	cd dist && rm -f SHA256SUMS* && sha256sum -- * > .sums && mv .sums SHA256SUMS

# With your SSH key: `make sign KEY=~/.ssh/id_ed25519`.
sign: sums
	ssh-keygen -Y sign -n walltopo -f $(KEY) dist/SHA256SUMS

# All that a release publishes, made anew and tried. No tag is needed and nothing is published.
PYTHONS ?= python3.11 python3.12 python3.13
release-check: $(VENV)/release-ready
	$(BIN)/python -m tools.pages.outdated
	rm -rf dist
	$(MAKE) --no-print-directory wheels sbom npm-package clients
	$(BIN)/python -m twine check --strict dist/*.whl dist/walltopo*.tar.gz
	$(MAKE) --no-print-directory sums
	$(BIN)/python -m tools.release_check dist $(PYTHONS)
	$(BIN)/python -m tools.upgrade_check $(UPGRADE_FROM)

# As root: the image of the platform on Debian's packages alone, and a gym's day in it.
containers: $(VENV)/dev-ready web browser database
	@for program in mmdebstrap buildah; do command -v $$program >/dev/null \
	  || apt-get install -y -qq --no-install-recommends $$program >/dev/null || exit 1; done
	$(BIN)/python -m gym.benchmarks.containers

npm-package:
	cd viewer && npm ci --no-audit --no-fund && mkdir -p ../dist && npm pack --pack-destination ../dist

# Made of the server's document, by the tools of the app.
clients: $(VENV)/release-ready web
	$(BIN)/python -m tools.clients dist

# The types of the app's client of the API are made of the server's own document, and checked with the app.
app: $(VENV)/dev-ready web
	mkdir -p gym/web/build && $(BIN)/python -m walltopo_gym.server.document gym/web/build/openapi.json
	cd gym/web && npm run api && npm run check

# Asks PyPI and npm what is known of the versions that are installed and pinned; fails where it could not ask.
audit: $(VENV)/dev-ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check pip-audit
	$(BIN)/python -m tools.audit

pictures:
	cd viewer && node tests/pictures.mjs --readme $(abspath $(GYM)) $(abspath $(SPRAYWALL))
	cd viewer && node tests/pictures.mjs --setter $(abspath $(DEMO))
	$(BIN)/python -m tools.pages.photo_pictures examples/demo-photos docs/pictures/setter

# The README's film, of a finished scan.
film: $(VENV)/dev-ready
	mkdir -p build/film
	for kind in whole route phone-route; do (cd viewer && node tests/pictures.mjs \
	  $(abspath $(DEMO))/index.html ../build/film/$$kind.jpg $$kind) || exit 1; done
	$(BIN)/python -m tools.pages.film scan $(DEMO) build/film docs/pictures/film.webp

# The film of docs/grades.md, of a finished scan with moves: a child and a tall adult on its route ROUTE.
moves-film: $(VENV)/dev-ready
	for who in child tall; do (cd viewer && node tests/moves.mjs \
	  $(abspath $(DEMO))/index.html ../build/film/$$who $(ROUTE) $$who) || exit 1; done
	$(BIN)/python -m tools.pages.film moves build/film/child build/film/tall docs/pictures/moves.webp

# The browser tests want Chromium, Firefox, WebKitGTK and node; where they cannot be had, those tests skip and say so.
browser:
	@(for program in chromium firefox-esr WebKitWebDriver Xvfb npm; do command -v $$program >/dev/null || exit 1; done) \
	  || $(MAKE) --no-print-directory system \
	  || echo "no browser, or not all: their tests will be skipped"
	@if command -v npm >/dev/null; then for folder in viewer gym/web; do \
	  [ $$folder/node_modules/.package-lock.json -nt $$folder/package-lock.json ] \
	    || (cd $$folder && npm ci --no-audit --no-fund --silent) \
	    || echo "npm ci failed: the tests of $$folder will be skipped"; done; fi

# The tests of the platform and one of the lab run on a PostgreSQL of their own.
database:
	@command -v initdb >/dev/null || ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 \
	  || { command -v apt-get >/dev/null && $(SUDO) apt-get update -qq \
	       && $(SUDO) apt-get install -y -qq postgresql >/dev/null; } \
	  || echo "no PostgreSQL: the platform is tested on SQLite alone, tuning on one machine"

# Kill it at any moment; a later `make train` goes on. TRAIN_DIR/train.html shows how it does.
train: $(VENV)/dev-ready
	$(TRAIN_ENV) nice -n 5 taskset -c $(TRAIN_CORE) $(BIN)/python -m walltopo_lab.train.shipped run \
	  --data $(DATA) --state $(TRAIN_DIR)

# Training may go on meanwhile. EXPORT=--replace replaces the shipped network if the new one is better.
train-export: $(VENV)/dev-ready
	OMP_NUM_THREADS=1 $(BIN)/python -m walltopo_lab.train.shipped export \
	  --data $(DATA) --state $(TRAIN_DIR) $(EXPORT)

# Quantizes the shipped network. EXPORT=--replace ships the result if it is hardly less accurate.
train-quantize: $(VENV)/dev-ready
	OMP_NUM_THREADS=1 $(BIN)/python -m walltopo_lab.train.shipped quantize \
	  --data $(DATA) --state $(TRAIN_DIR) $(EXPORT)

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
	@for package in python3-venv python3-dev g++ chromium firefox-esr webkit2gtk-driver xvfb openssl libgl1-mesa-dri postgresql $$(command -v npm >/dev/null || echo nodejs npm); do \
	  $(SUDO) apt-get install -y -qq $$package >/dev/null || exit 1; done

clean:
	rm -rf $(VENV) build/site site demo-scan demo-gym viewer/node_modules gym/web/node_modules
