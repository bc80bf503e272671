# SPDX-License-Identifier: MIT
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
MAKEFLAGS += --no-builtin-rules --no-print-directory
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
.PHONY: run study test mutate sanitize lint lint-python lint-cpp format bench docs wheel wheels release clean help \
  system-packages system-lint-packages system-test-packages

# Set one to nothing to keep make away from the system's packages.
# The development tree has tests and benchmarks too: GoogleTest and Google Benchmark are for them.
SYSTEM_PACKAGES = g++ cmake ninja-build libeigen3-dev libboost-dev libxsimd-dev libceres-dev libgtest-dev \
  libbenchmark-dev python3-venv python3-dev
SYSTEM_LINT_PACKAGES = clang-format clang-tidy
# Large, so for CI alone: without a browser the tests of pages are skipped, and say so.
SYSTEM_TEST_PACKAGES = $(if $(CI),chromium)

PYTHON := .venv/bin/python
STAMPS := .venv/stamps
JOBS := $(shell nproc)
# Directories are listed so that a deleted file is noticed.
sources = $(shell find $(1) ! -name '__pycache__' ! -name '*.pyc' ! -name '.*' ! -name '\#*' \
  \( -type f -o -type d \))
PACKAGE_SOURCES := CMakeLists.txt CMakePresets.json pyproject.toml README.md LICENSE THIRD-PARTY-NOTICES.txt \
  $(call sources,cmake cpp/symkin cpp/bindings python mechanisms)
CPP_FILES = $(shell find cpp tests benchmarks -name '*.hpp' -o -name '*.cpp')
CMAKE_LISTS = CMakePresets.json CMakeLists.txt $(shell find cpp tests benchmarks -name CMakeLists.txt)

run: $(STAMPS)/package ## Run the whole protocol on the 3-RRR and write out/3RRR/report.html
	@.venv/bin/symkin run 3RRR --out out/3RRR --overwrite

study: $(STAMPS)/paper $(STAMPS)/cluster ## Judge the paper by a thousand robots a protocol and write out/study/report.html
	@.venv/bin/symkin study paper --workers $(JOBS) --out out/study --overwrite

test: build/dev/configured $(STAMPS)/test | system-test-packages ## Build and run the C++ and the Python tests
	@cmake --build --preset dev --parallel $(JOBS)
	@$(MAKE) $(STAMPS)/paper
	@scripts/test

sanitize: build/sanitize/configured ## Run the C++ tests under the address and undefined-behaviour sanitizers
	@cmake --build --preset sanitize --parallel $(JOBS)
	@ctest --preset sanitize --parallel $(JOBS)

lint: build/dev/configured $(STAMPS)/lint | system-lint-packages ## Check format, style and types
	@$(MAKE) --jobs 2 --output-sync lint-python lint-cpp

lint-python:
	@$(PYTHON) -m ruff check --quiet
	@$(PYTHON) -m ruff format --check --quiet
	@$(PYTHON) -m mypy
	@PYTHONPATH=python:paper .venv/bin/lint-imports --no-logo --no-cache >build/imports.log || { cat build/imports.log; exit 1; }

lint-cpp:
	@clang-format --dry-run -Werror $(CPP_FILES)
	@$(PYTHON) scripts/tidy.py build/dev cpp

format: $(STAMPS)/lint | system-lint-packages ## Rewrite the sources in the project's format
	@clang-format -i $(CPP_FILES)
	@$(PYTHON) -m ruff check --fix --quiet
	@$(PYTHON) -m ruff format --quiet

mutate: build/dev/configured ## Put small defects into the C++ sources and expect a test to fail at each: some twenty minutes
	@scripts/mutate

bench: $(STAMPS)/package $(STAMPS)/bench ## Build and run the benchmarks
	@cmake --build --preset dev --parallel $(JOBS) --target benchmarks
	@scripts/bench

docs: $(STAMPS)/paper $(STAMPS)/docs ## Build the documentation into build/docs
	@$(PYTHON) -m sphinx -q -W --keep-going -b html docs build/docs
	@$(PYTHON) scripts/check_site.py build/docs
	@echo build/docs/index.html

wheel: $(STAMPS)/package $(STAMPS)/wheel ## Pack a wheel into dist and try it in a bare environment
	@scripts/wheel

wheels: $(STAMPS)/requirements $(STAMPS)/cross ## Pack wheels for glibc 2.28, x86-64 and aarch64, into dist; compiles both anew
	@scripts/cross-wheel x86_64
	@scripts/cross-wheel aarch64

release: $(STAMPS)/wheel ## Go through the checklist of a release; publishes nothing
	@scripts/release

clean: ## Remove all that make has made
	@rm -rf build dist .venv out .benchmarks .hypothesis .mypy_cache .pytest_cache .ruff_cache

help: ## Say what make can do
	@sed -n 's/^\([a-z]*\):.*## /\1 /p' $(MAKEFILE_LIST) | \
	  while read -r target purpose; do printf '  make %-10s%s\n' "$$target" "$$purpose"; done

system-packages:
	@scripts/system-packages $(SYSTEM_PACKAGES)

system-lint-packages:
	@scripts/system-packages $(SYSTEM_LINT_PACKAGES)

system-test-packages:
	@scripts/system-packages $(SYSTEM_TEST_PACKAGES)

$(STAMPS)/venv: scripts/make-venv | system-packages
	@scripts/make-venv .venv
	@mkdir -p $(STAMPS) && touch $@

# Requirements of pyproject.toml: "requirements" to build and run with figures, or an extra.
$(STAMPS)/requirements $(STAMPS)/test $(STAMPS)/lint $(STAMPS)/docs $(STAMPS)/bench \
    $(STAMPS)/cluster $(STAMPS)/wheel $(STAMPS)/cross: \
    $(STAMPS)/%: pyproject.toml scripts/requirements.py $(STAMPS)/venv
	@echo "Installing Python packages: $(*:requirements=build, runtime and figures)"
	@$(PYTHON) scripts/requirements.py $(*:requirements=build runtime figures) > $@.txt
	@$(PYTHON) -m pip install -qq --disable-pip-version-check --no-compile -r $@.txt
	@touch $@

# Of the C++ library alone: Python would need the sanitizers' runtime too.
build/sanitize/configured: $(CMAKE_LISTS) | system-packages
	@mkdir -p build
	@cmake --preset sanitize >build/sanitize.log 2>&1 || { cat build/sanitize.log >&2; exit 1; }
	@touch $@

build/%/configured: $(CMAKE_LISTS) $(STAMPS)/requirements
	@echo "Configuring build/$*"
	@mkdir -p build
	@cmake --preset $* -D SYMKIN_BUILD_PYTHON=ON -D Python_EXECUTABLE=$(abspath $(PYTHON)) \
	  -D pybind11_DIR="$$($(PYTHON) -m pybind11 --cmakedir)" >build/$*.log 2>&1 || \
	  { cat build/$*.log >&2; exit 1; }
	@touch $@

# The core is compiled here, in sight; pip then finds it done and packs it.
$(STAMPS)/package: build/dev/configured $(PACKAGE_SOURCES)
	@cmake --build --preset dev --parallel $(JOBS) --target _core
	@$(PYTHON) -m pip install -qq --disable-pip-version-check --no-build-isolation --no-deps \
	  --force-reinstall --config-settings=build-dir=build/dev .
	@touch $@

# The reproduction of the paper, which the wheel leaves out.
$(STAMPS)/paper: $(STAMPS)/package $(call sources,paper)
	@$(PYTHON) -m pip install -qq --disable-pip-version-check --no-build-isolation --no-deps \
	  --force-reinstall ./paper
	@touch $@
