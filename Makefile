# make run    open the window on the sample vase (set-up included)
# make test   run the tests (set-up included)
# make check  linters, types, layers and tests
# PYTHON=python3.12 chooses the interpreter, ARGS="..." goes to the program or to pytest.

VENV ?= .venv
PYTHON ?=
ARGS ?=
PY = $(VENV)/bin/python
SETUP_INPUTS = pyproject.toml constraints.txt resources/setup.sh
WORKERS ?= 2

export VENV PYTHON

# Several BLAS threads in several test processes are slower than one each.
TEST_ENV = OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 QT_QPA_PLATFORM=xcb PYTHONFAULTHANDLER=1
# LOCALE=de_DE.UTF-8 runs the tests under that locale, made with localedef if the system lacks it.
LOCALE ?=
TEST_ENV += EIGENFORM_TEST_LOCALE=$(LOCALE)
PYTEST = $(TEST_ENV) xvfb-run -a -s "-screen 0 1600x1200x24" $(PY) -m pytest

.PHONY: run test check lint format types layers bench pictures soak clean

run: $(VENV)/ready/run
	$(PY) -m app $(ARGS)

test: $(VENV)/ready/test
	$(PYTEST) -n $(WORKERS) --dist worksteal --max-worker-restart 0 $(ARGS) </dev/null

check: lint test

lint: $(VENV)/ready/check
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	$(VENV)/bin/lint-imports

format: $(VENV)/ready/check
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

bench: $(VENV)/ready/check
	$(PY) -m pip install -q -c constraints.txt --no-build-isolation -e ".[bench]"
	$(PY) -m bench $(ARGS)

# All pictures of the README and the guide; ARGS=--all also dark and at twice the size, to look at.
pictures: $(VENV)/ready/test
	xvfb-run -a -s "-screen 0 2600x1800x24" $(PY) -m tests.pictures $(ARGS)

# A random walk through the window, for MINUTES.
MINUTES ?= 10
soak: $(VENV)/ready/test
	EIGENFORM_SOAK_MINUTES=$(MINUTES) $(PYTEST) -m soak --timeout 0 -o faulthandler_timeout=0 $(ARGS) </dev/null

clean:
	rm -rf $(VENV) build dist *.egg-info artefacts pictures-out
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

# A later stage holds what an earlier one does.
$(VENV)/ready/%: $(SETUP_INPUTS)
	sh resources/setup.sh $*
