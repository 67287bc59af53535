# Each target does its own set-up, once; arguments pass through: make live ARGS="--port 9000"
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: set-up together checks programs style types page-check page-test engine-check help soak live test test-all suite firmware-test fuzz bench docs board claims gallery lint lock native wheel release clean page dev

VENV := .venv
PY := $(VENV)/bin/python
PIP := $(PY) -m pip --disable-pip-version-check --quiet
# uv installs in a tenth of pip's time; where it cannot (a mirror that only pip knows), pip does.
PINNED := scripts/install.sh $(PY)
# Two processes a core, for tests wait half of their time: for a clock, a browser, a board. A file's
# tests stay together, since they share what they set up.
PYTEST := $(PY) -m pytest -n $$(expr 2 \* $$(getconf _NPROCESSORS_ONLN)) --maxprocesses 8 --dist loadfile

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1	/p' Makefile

live: together  ## the live page of a simulated skin
	@$(VENV)/bin/tomoskin live $(ARGS)

together: $(VENV)/.uv  # two cores have two things to do: Python packages and the page
	@$(MAKE) --no-print-directory page & page=$$!; \
		$(MAKE) --no-print-directory $(VENV)/.runtime; packages=$$?; \
		wait $$page && exit $$packages
	@$(MAKE) --no-print-directory $(VENV)/.installed

test: set-up  ## lint, documentation, page tests and the test suite, without what is slow
	@$(MAKE) --no-print-directory -j3 --output-sync=target checks suite

test-all: set-up  ## the same, with what is slow
	@$(MAKE) --no-print-directory -j3 --output-sync=target checks suite MARKED='-m ""'

# The plus keeps make from holding its output back until the end.
suite: programs native page
	+@$(PYTEST) $(MARKED) $(ARGS)

firmware-test: dev  ## the firmware alone: GoogleTest, mutants, host build, emulator
	@sh scripts/firmware.sh
	@$(PY) -m pytest -m "" tests/firmware tests/board/wire/test_fuzz.py $(ARGS)

fuzz: dev  ## ten million mutated streams through the parsers of board and host; ten minutes
	@sh scripts/firmware.sh
	@sh scripts/fuzz.sh $(PY) $(ARGS)

bench: native  ## all in one table, beside plain scipy and, where it is installed, pyEIT; three minutes
	@$(VENV)/bin/tomoskin bench $(ARGS)

soak: dev  ## an hour of a bad day, compressed: faults, a sleeping page, a hanging sink
	@SOAK_MINUTES=60 $(PY) -m pytest -n 0 -m "" tests/run/test_soak.py $(ARGS)

docs: dev $(VENV)/.docs  ## the documentation, in build/docs; a warning is an error
	@$(PY) -m sphinx --quiet --fail-on-warning --keep-going docs build/docs

board: dev  ## the circuit boards: rules, then netlists, bills, Gerbers, pictures, zip; needs KiCad 9
	@$(PIP) install --no-deps --require-hashes --upgrade --target build/board/tools --requirement requirements/board.txt
	@$(PY) hardware/fabricate.py $(ARGS)

claims: native page  ## run what the published figures come from; fails where one no longer holds (PART=gallery: ten minutes)
	@$(PIP) install --require-hashes --requirement requirements/bench.txt  # pyEIT has no wheel
	@$(PY) scripts/native.py reference
	@$(PY) docs/claims.py $(PART) $(ARGS)

gallery: native  ## run the examples again into docs/gallery.md; ten minutes
	@$(PY) docs/claims.py gallery --accept

lint: style types page-check engine-check  ## ruff, mypy, the page's types, and the native engine's where Rust is installed

style: dev
	@$(PY) -m ruff check .
	@$(PY) -m ruff format --check .

types: dev
	@$(PY) -m mypy src tests

page-check: dev page
	@$(PY) scripts/page.py run check

page-test: dev page page-check
	@$(PY) scripts/page.py run test

engine-check: dev native
	@MAKEFLAGS= $(PY) scripts/native.py check

checks: lint page-test docs  # side by side: two cores have two things to do

# What the tests need beside Python packages: Debian's, by apt-get where that is allowed.
programs: $(VENV)/.dev
	@for thing in chromium mosquitto firmware ngspice; do sh scripts/$$thing.sh || exit 1; done

set-up: together dev $(VENV)/.docs
	@mkdir -p build && rm -f build/left-out.txt
	@echo "checks and tests, side by side: style, types, page, documentation, native engine, test suite"

native: dev  ## the native engine, where Rust is installed; live runs without
	@MAKEFLAGS= $(PY) scripts/native.py

wheel: dev page  ## a wheel with the built page, in dist/
	@$(PY) -m hatchling build -t wheel

release: test-all  ## everything tested, then sdist and wheels into dist/, tried in an empty environment; nothing is uploaded
	@$(PY) scripts/release.py

lock: dev  ## pin the newest packages, with hashes, in requirements/*.txt
	@for out in $(LOCKS); do $(MAKE) --no-print-directory lock-$$out || exit 1; done

clean:  ## remove everything that make made
	rm -rf $(VENV) build dist src/tomoskin/server/static firmware/emulator/tomoskin_emulator/images web/node_modules
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis

# Set-up. A stamp's time says when its step was last done.

$(VENV)/.made: scripts/venv.sh requirements/uv.txt
	@sh scripts/venv.sh $(VENV)
	@touch $@

$(VENV)/.uv: $(VENV)/.made
	@sh $(PINNED) requirements/uv.txt
	@touch $@

$(VENV)/.runtime: requirements/runtime.txt $(VENV)/.uv
	@echo "set-up: Python packages"
	@sh $(PINNED) $<
	@touch $@

$(VENV)/.dev: requirements/dev.txt $(VENV)/.runtime
	@echo "set-up: Python packages for tests"
	@sh $(PINNED) $<
	@touch $@

$(VENV)/.docs: requirements/docs.txt $(VENV)/.dev
	@echo "set-up: Python packages for the documentation"
	@sh $(PINNED) $<
	@touch $@

# Without build isolation: the backend is among the pinned packages, and nothing is downloaded.
$(VENV)/.installed: pyproject.toml hatch_build.py $(VENV)/.runtime | page
	@$(PIP) install --no-build-isolation --no-deps --no-index --editable .
	@touch $@

dev: $(VENV)/.dev $(VENV)/.installed
	@$(PY) scripts/page.py has-node || sh $(PINNED) requirements/node.txt

page: $(VENV)/.uv
	@$(PY) scripts/page.py fresh || { echo "set-up: the page"; \
		{ $(PY) scripts/page.py has-node || sh $(PINNED) requirements/node.txt; } \
		&& $(PY) scripts/page.py build; }

COMPILE := $(PY) -m uv --quiet pip compile --upgrade --universal --python-version 3.11 \
	--generate-hashes --no-emit-index-url --custom-compile-command "make lock"
LOCKS := uv runtime dev docs bench node
.PHONY: $(LOCKS:%=lock-%)
lock-uv:
	@$(COMPILE) requirements/uv.in -o requirements/uv.txt
lock-runtime:
	@$(COMPILE) pyproject.toml --extra plot requirements/build.in -o requirements/runtime.txt
lock-dev:
	@$(COMPILE) pyproject.toml --extra mesh --extra plot --extra parquet --extra hdf5 --extra foxglove --extra mqtt --extra lsl --extra ros2 --extra cluster --extra xacro requirements/dev.in -c requirements/runtime.txt -o requirements/dev.txt
lock-docs:
	@$(COMPILE) requirements/docs.in -c requirements/dev.txt -o requirements/docs.txt
lock-bench:
	@$(COMPILE) pyproject.toml --extra bench -c requirements/dev.txt -o requirements/bench.txt
lock-node:
	@$(COMPILE) requirements/node.in -o requirements/node.txt
