PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# matrices are small here: more BLAS threads only get in each other's way
export OPENBLAS_NUM_THREADS ?= 1
SOURCES := pyproject.toml CMakeLists.txt $(wildcard kernels/*)

.PHONY: install demo test test-all check bench docs clean

install: $(VENV)/.installed

$(VENV)/.created:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	touch $@

$(VENV)/.installed: $(VENV)/.created $(SOURCES)
	$(BIN)/python -m pip install --quiet "scikit-build-core>=0.11" "nanobind>=2.7" "cmake>=3.18" ninja
	$(BIN)/python -m pip install --quiet --no-build-isolation --editable .
	touch $@

$(VENV)/.developer: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --group dev
	touch $@

demo: install
	$(BIN)/flexcal demo --seed 1 --out demo
	cp demo/report.html report.html
	@echo "open report.html"

# two processes, a file always in one of them: its fixtures are made once
test: $(VENV)/.developer
	$(BIN)/python -m pytest -n 2 --dist loadfile

test-all: $(VENV)/.developer
	$(BIN)/python -m pytest -n 2 --dist loadfile -m ""

check: $(VENV)/.developer docs
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

docs: $(VENV)/.developer
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs build/docs

bench: $(VENV)/.developer
	$(BIN)/python -m benchmarks

clean:
	rm -rf build $(VENV) demo report.html
