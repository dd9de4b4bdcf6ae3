PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# matrices are small here: more BLAS threads only get in each other's way
export OPENBLAS_NUM_THREADS ?= 1
# else every process compiles what has changed since the installation, and all tests
unexport PYTHONDONTWRITEBYTECODE
SOURCES := pyproject.toml CMakeLists.txt $(wildcard kernels/* runtime/include/flexcal/*.hpp runtime/include/flexcal/runtime/*.hpp)

.PHONY: install demo test test-statistical test-all coverage sanitize check bench docs wheels clean

install: $(VENV)/.installed

$(VENV)/.created:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	touch $@

$(VENV)/.installed: $(VENV)/.created $(SOURCES)
	$(BIN)/python -m pip install --quiet "scikit-build-core>=0.11" "nanobind>=2.7" "cmake>=3.18" ninja
	$(BIN)/python -m pip install --quiet --no-build-isolation --editable .
	$(BIN)/python -m compileall -q src  # else every process compiles it where PYTHONDONTWRITEBYTECODE is set
	touch $@

$(VENV)/.developer: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --group dev
	touch $@

demo: install
	$(BIN)/flexcal demo --seed 1 --out demo
	cp demo/report.html report.html
	@echo "open report.html"

# three processes for two cores, as tests of pages and of killed processes wait half of their time; a file always in one of them: its
# fixtures are made once; in the order of names, else the long files of one test come last
PARALLEL := -n 3 --dist loadfile --no-loadscope-reorder

test: $(VENV)/.developer
	$(BIN)/python -m pytest $(PARALLEL)

test-statistical: $(VENV)/.developer
	$(BIN)/python -m pytest $(PARALLEL) -m "statistical and not slow"

test-all: $(VENV)/.developer sanitize
	$(BIN)/python -m pytest $(PARALLEL) -m ""

# the lines and branches that these tests reach: a summary, and pages in build/coverage
coverage: $(VENV)/.developer
	$(BIN)/python -m pytest $(PARALLEL) --cov --cov-report=term:skip-covered --cov-report=html

# the kernels' tests, and the runtime's fuzzing, on a build that checks every access to memory and every undefined operation; needs g++
SANITIZED := build/sanitize
PRELOADED = $(foreach library,asan ubsan stdc++,$(shell g++ -print-file-name=lib$(library).so))
KERNEL_TESTS := tests/test_kernels.py tests/frequency/test_covariance.py tests/runtime/test_runtime_equality.py tests/model tests/virtual_cell/test_stepping.py

sanitize: $(VENV)/.developer
	PATH="$(CURDIR)/$(BIN):$$PATH" cmake -S . -B $(SANITIZED) -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=g++ -DSANITIZE=ON \
	  -DPython_EXECUTABLE="$(CURDIR)/$(BIN)/python" -Dnanobind_DIR="$$($(BIN)/python -m nanobind --cmake_dir)" > /dev/null
	PATH="$(CURDIR)/$(BIN):$$PATH" cmake --build $(SANITIZED)
	LD_PRELOAD="$(PRELOADED)" ASAN_OPTIONS=detect_leaks=0:alloc_dealloc_mismatch=0 UBSAN_OPTIONS=print_stacktrace=1 \
	  SANITIZED_KERNELS="$(CURDIR)/$(SANITIZED)" $(BIN)/python -m pytest -q -p no:xdist -p sanitized_kernels -m "" $(KERNEL_TESTS)
	g++ -std=c++17 -g -O1 -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all -Iruntime/include \
	  tests/runtime/runtime_fuzzer.cpp -o $(SANITIZED)/runtime_fuzzer
	$(SANITIZED)/runtime_fuzzer tests/runtime/corpus 1500

check: $(VENV)/.developer docs
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

docs: $(VENV)/.developer
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs build/docs

bench: $(VENV)/.developer
	$(BIN)/python -m benchmarks

# sdist and a wheel for $(PYTHON) in dist/, checked in a fresh environment without a compiler
wheels:
	$(PYTHON) .ci/wheels.py

clean:
	rm -rf build dist $(VENV) demo report.html
