# Every target sets up what it needs: .venv with the versions in requirements.lock.
# Another Python: make test PYTHON=python3.12

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:

PYTHON ?= python3
JOBS ?= 2
VENV := .venv
BIN := $(VENV)/bin
PIP = $(BIN)/python -m pip --disable-pip-version-check
# NumPy has the newest version that the peer sysidentpy accepts; of torch a free range brings gigabytes of CUDA.
PINNED := numpy==2.3.5 torch==2.13.0

# With other kernels of linear algebra some fits end elsewhere; with these the kept answers hold on all x86 processors.
ALIKE := OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 OPENBLAS_CORETYPE=Haswell

VERSION := $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)
# The name holds the version, so that another Python makes another environment.
INSTALLED := $(VENV)/installed-$(VERSION)

.PHONY: help dev peers test test-slow benchmark speed lint lock clean

help:
	@echo "make benchmark   quick models on all data sets at hand, as tables in the terminal and in results/"
	@echo "make test        the tests; make test-slow for those that take minutes, after make peers with SIPPY;"
	@echo "                 MINUTES=30 leaves out what has not begun by then"
	@echo "make lint        format, style and types; make dev sets up .venv and stops"
	@echo "make speed       times beside those of other tools, with make peers"
	@echo "make peers       those other tools into .venv"
	@echo "make lock        newer versions into the lock files, with Python 3.11"
	@echo "make clean       remove what was built, .venv included; results/ stays"

dev: $(INSTALLED)

# setuptools comes first and builds what has no wheel, so that nothing but locked versions is ever used.
$(INSTALLED): requirements.lock pyproject.toml
	@case "$(VERSION)" in 3.11|3.12|3.13) ;; *) \
	  echo "simgap needs Python 3.11, 3.12 or 3.13, and '$(PYTHON)' is $(or $(VERSION),not there);" \
	    "name another: make $(MAKECMDGOALS) PYTHON=python3.12" >&2; exit 1;; esac
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "'$(PYTHON)' cannot make virtual environments; on Debian and Ubuntu install python3-venv" >&2; exit 1; }
	@echo "Setting up $(VENV) with Python $(VERSION), one to three minutes ..."
	@rm -rf $(VENV)
	@$(PYTHON) -m venv $(VENV)
	@$(PIP) install --quiet $$(grep '^setuptools==' requirements.lock)
	@$(PIP) install --quiet --use-pep517 --no-build-isolation -r requirements.lock
	@$(PIP) install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

peers: $(VENV)/peers-$(VERSION)
$(VENV)/peers-$(VERSION): requirements-peers.lock $(INSTALLED)
	@$(PIP) install --quiet --no-deps -r requirements-peers.lock
	@touch $@

test: $(INSTALLED)
	@echo "Slow tests are left out; make test-slow runs them."
	@$(ALIKE) $(BIN)/python -m pytest -q -m "not slow" --numprocesses $(JOBS) --dist loadfile

test-slow: $(INSTALLED)
	@$(ALIKE) $(BIN)/python -m pytest -q -m slow $(addprefix --minutes=,$(MINUTES)) --numprocesses $(JOBS) --dist worksteal

# After an interruption, or with one more model, only what is not in results/ yet is run. A failed job (1) is a row of
# the tables, so they are shown all the same. Where there is no terminal, its width does not hide columns.
benchmark: $(INSTALLED)
	@[ ! -d results ] || echo "Carrying on in results/: jobs whose data and model are unchanged are not run again."
	@[ -t 1 ] || export COLUMNS=200; failed=0; $(BIN)/simgap run benchmark --jobs $(JOBS) --out results || failed=$$?; \
	  [ $$failed -gt 1 ] || $(BIN)/simgap report results; exit $$failed

# Without the conftest.py above it, whose checks of shapes would be timed along.
speed: peers
	@$(BIN)/python -m pytest -q --confcutdir=tests/speed tests/speed/bench_*.py

# pyright finds the mapped name only in an installed copy; sed turns its paths back into ours.
lint: $(INSTALLED)
	@$(BIN)/ruff check
	@$(BIN)/ruff format --check
	@rm -rf build
	@$(PIP) install --quiet --no-deps --no-build-isolation --target build/typing .
	@$(BIN)/pyright --pythonpath $(BIN)/python | sed -E \
	  -e 's#[^ ]*build/typing/simgap/(baselines|neural|data|reports)/#\1/#' -e 's#[^ ]*build/typing/simgap/#benchmark/#'

# The oldest Python decides, because packages drop it first. The comments on top of the files stay.
lock:
	@[ "$(VERSION)" = 3.11 ] || { echo "the lock files need Python 3.11: make lock PYTHON=python3.11" >&2; exit 1; }
	@rm -rf build && mkdir build && $(PYTHON) -m venv build/lock
	@build/lock/bin/python -m pip install --quiet --upgrade pip
	@build/lock/bin/python -m pip install --quiet $(PINNED) --group dev .
	@grep '^#' requirements.lock > build/requirements.lock
	@build/lock/bin/python -m pip freeze --all --exclude pip --exclude simgap | sed 's/+cpu$$//' >> build/requirements.lock
	@build/lock/bin/python -m pip install --quiet -r build/requirements.lock ".[peers]"
	@grep '^#' requirements-peers.lock > build/requirements-peers.lock
	@build/lock/bin/python -m pip freeze --all --exclude pip --exclude simgap | sed 's/+cpu$$//' \
	  | grep -vxFf build/requirements.lock >> build/requirements-peers.lock
	@mv build/requirements.lock build/requirements-peers.lock .
	@git diff --stat -- '*.lock' || true

clean:
	@rm -rf $(VENV) build dist *.egg-info .pytest_cache .ruff_cache .hypothesis .benchmarks
	@find . -name __pycache__ -prune -exec rm -rf {} +
