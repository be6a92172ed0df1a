# Bootstrap and thin aliases. `make fig2` builds Figure 2 from nothing, `make test` runs the tests.
# They presume Python 3.11 to 3.13 with venv and pip, and make.
SHELL := /bin/bash
MAKEFLAGS += --no-builtin-rules
# Of a cluster's modules: they would hide the packages of .venv.
unexport PYTHONPATH PYTHONHOME
PYTHON ?= python3
BIN := .venv/bin
# Without names of several words to make, or with signs of its own: the workflow refuses those.
STUDIES := $(shell cd experiments 2>/dev/null && for file in */problem.yaml */figure.yaml; do name="$${file%/*}"; \
    [ ! -e "$$file" ] || [[ "$$name" == *[[:space:][:punct:]]* && ! "$$name" =~ ^[[:alnum:]_@.-]+$$ ]] || echo "$$name"; done)
PAGES := all fig1 index movies calibrate validation benchmark any_load
PRODUCTS := $(foreach product,fabrication recordings spectrum sweep gains certificate front,$(addsuffix _$(product),$(STUDIES)))
# A folder of packages, in place of a network: make wheels WHEELS=folder, later make setup WHEELS=folder
WHEELS ?=
SETTING_UP = $(if $(wildcard .venv/requirements.lock),$(BIN)/python,$(PYTHON))
INSTALL = $(SETTING_UP) pipeline/workflow/install_lock.py .venv --compiler requirements-compiler.lock $(if $(WHEELS),--wheels "$(WHEELS)")
PYTEST ?= -n auto --dist loadscope --no-loadscope-reorder --ignore tests/clients --ignore tests/cluster --ignore tests/slow -m 'not slow'
SOURCES := $(wildcard sim pipeline reports benchmarks tests docs)
WORKFLOW := Snakefile $(wildcard pipeline/rules/*.smk)

# Programs of an environment begin with its folder: in one that was moved they do not start.
MOVED := $(shell [ -L .venv ] || [ ! -e .venv/bin/pip ] || head -n 2 .venv/bin/pip | grep -qF "$$(pwd -P)/.venv/" || echo yes)
$(if $(MOVED),$(warning .venv was made in another folder, its programs may not start: rm -r .venv, then make setup))
# The Python that made .venv may have been removed, replaced by a newer one, or be of a module that is not loaded.
GONE := $(shell [ ! -e .venv/requirements.lock ] || [ -d .venv/lib/"$$($(BIN)/python -ISc \
    'import sys; print("python%d.%d" % sys.version_info[:2])' 2>/dev/null)"/site-packages ] || echo yes)
$(if $(GONE),$(warning the Python of .venv is not here any more: bring it back, or rm -r .venv, then make setup))

# By the environment: names of folders never are words of a shell's command.
export TARGET = $@

.PHONY: help setup dev publish reproduce wheels test nightly test-slow pythons clients cluster docs lint format bench bench-tracking stress survive mutants lock clean $(PAGES) $(STUDIES) $(PRODUCTS)

help:
	$(info make fig2      build Figure 2: results/fig2/report/index.html (studies here: $(STUDIES)))
	@echo "make fig2@P    the same with preset P of experiments/fig2/problem.yaml"
	@echo "make fig2_fabrication   drawings, meshes and papers of what is built: results/fig2/fabrication"
	@echo "make fig2_recordings    videos of the specimens, tracked: results/fig2/recordings"
	@echo "make fig7_spectrum      modes, transmission and waves of a study that asks for them"
	@echo "make fig2_sweep         losses over the parameters of a study's sweep, whichever they are"
	@echo "make fig2_gains         what designs gain that hold against more than the study asks for"
	@echo "make any_load  a cloak for loads in ranges: certified under 1000 random and 50 searched ones"
	@echo "make fig2_certificate   the worst of random and searched loads, of a study with loads in ranges"
	@echo "make fig2_front         what it costs to hold against any load: a front of designs, and what limits them"
	@echo "make fig1      the framework as a schematic"
	@echo "make all       build every figure of the paper and the page over them: results/index.html"
	@echo "make calibrate constants of the specimens from tests of small ones: results/calibration"
	@echo "make validation  measured specimens beside their prediction: results/validation/index.html"
	@echo "make index     that page alone, over what is there"
	@echo "make movies    the paper's movies: results/movies"
	@echo "make reproduce build fig2@quick (or STUDY=...) twice from nothing, and compare all bytes"
	@echo "make publish   build fig2 (or STUDY=...) and write it as an RO-Crate: results/fig2_crate"
	@echo "make test      run the tests"
	@echo "make nightly   run what takes longer: the four below, with a table of them (PARTS=clients: one)"
	@echo "make test-slow run the tests that make test leaves out: two builds from nothing, kills at random"
	@echo "make clients   run the tests that need other programs: Chromium, a slicer, CAD (see .ci/nightly)"
	@echo "make cluster   make this machine a SLURM of one node and run the tests on it"
	@echo "make pythons   run a quick part of the tests on the other Pythons that pyenv has installed"
	@echo "make benchmark run time against error of every solver, and more: results/benchmark (an hour)"
	@echo "make bench     measure speed against the baselines"
	@echo "make bench-tracking   measure tracking: rendered clips, known pictures, VIDEOS=folder"
	@echo "make stress    try to break the numbers: results/stress/index.html; fails if any is wrong"
	@echo "make survive   damaged files, killed runs, full disks: results/survival (PARTS=inputs fuzz kills places)"
	@echo "make mutants   change 200 places of the source, one by one, and count what no test notices"
	@echo "make lint      ruff, mypy, snakefmt, snakemake --lint"
	@echo "make setup     only make .venv from requirements.lock; with WHEELS=folder, from that folder alone"
	@echo "make dev       the same, with the tools of tests, linters and documentation"
	@echo "make wheels WHEELS=folder   download what make setup needs into the folder"
	@echo "make format    let the linters rewrite the source"
	@echo "make docs      the documentation as a site: results/docs/index.html"
	@echo "make lock      renew requirements.lock from pyproject.toml (with Python 3.11)"
	@echo "make clean     remove results and caches (.venv stays)"

setup: .venv/requirements.lock
dev: .venv/requirements-dev.lock

# It runs in any Python, of which some print their version as an error.
define refuse_other_pythons
@$(1) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' 2>/dev/null || { \
    found=$$($(1) --version 2>&1) || found="not here"; \
    echo "error: this needs Python 3.11, 3.12 or 3.13, but '$(1)' is $$found." \
    "Name another one: make $(or $(MAKECMDGOALS),setup) PYTHON=python3.12" >&2; exit 1; }
endef

# An environment that is there stays with its Python.
.venv/requirements.lock: requirements.lock
	$(call refuse_other_pythons,$(SETTING_UP))
	@$(INSTALL) requirements.lock

.venv/requirements-dev.lock: requirements-dev.lock .venv/requirements.lock
	@$(INSTALL) requirements.lock requirements-dev.lock

# Into the same folder for every Python that is to be served: make wheels WHEELS=folder PYTHON=python3.12
wheels:
	$(call refuse_other_pythons,$(PYTHON))
	@$(PYTHON) -m venv --clear .cache/download
	@.cache/download/bin/python -m pip download --quiet --disable-pip-version-check --require-hashes \
	    -r requirements-dev.lock -r requirements-compiler.lock --dest "$(or $(WHEELS),wheels)"
	@rm -rf .cache/download

$(STUDIES) $(PAGES): setup
	@exec $(BIN)/python -m pipeline run "$$TARGET"

# what a lab builds of a study, and what it films: make fig2_fabrication, make fig2_recordings
$(PRODUCTS): setup
	@exec $(BIN)/python -m pipeline run "$$TARGET"

# A study with a preset: make fig2@edge3. A pattern a rule, as one rule of several counts all of them as made.
define preset_of
$(1)@%: setup
	@exec $$(BIN)/python -m pipeline run "$$$$TARGET"
endef
$(foreach study,$(STUDIES),$(eval $(call preset_of,$(study))))

publish: setup
	@$(BIN)/python -m pipeline publish $(or $(STUDY),fig2) --check
	@exec $(BIN)/python -m pipeline run $(or $(STUDY),fig2)
	@$(BIN)/python -m pipeline publish $(or $(STUDY),fig2)

reproduce: setup
	@$(BIN)/python -m pipeline reproduce $(STUDY)

test: dev
	$(BIN)/python -m pytest $(PYTEST)

nightly: dev
	@.ci/nightly $(PARTS)

pythons:
	@.ci/pythons

docs: dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

test-slow: dev
	$(BIN)/python -m pytest -n auto --dist loadfile -m slow --ignore tests/clients --ignore tests/cluster

clients: dev
	$(BIN)/python -m pytest -n 2 --dist loadfile tests/clients

cluster: dev
	$(BIN)/python -m pytest tests/cluster

lint: dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/snakefmt --check $(WORKFLOW)
	$(BIN)/snakemake --lint

format: dev
	$(BIN)/ruff check --fix
	$(BIN)/ruff format
	$(BIN)/snakefmt $(WORKFLOW)

bench: dev
	$(BIN)/python -m benchmarks

# In an environment of its own: pyvale brings another OpenCV and pins netCDF4.
bench-tracking: dev
	@test -x .cache/pyvale/bin/python || { $(BIN)/uv venv --quiet .cache/pyvale && $(BIN)/uv pip install --quiet \
	    --only-binary :all: --python .cache/pyvale/bin/python pyvale==2026.10.2; } || \
	    { rm -rf .cache/pyvale; echo "pyvale cannot be installed here: its columns stay empty"; }
	$(BIN)/python -m benchmarks tracking $(if $(VIDEOS),--videos "$(VIDEOS)")

stress: dev
	@$(BIN)/python -m benchmarks.stress; code=$$?; \
	    $(BIN)/python -m reports stress --counts results/stress/stress.json --out-dir results/stress --quiet && exit $$code

survive: dev
	@$(BIN)/python -m tests.hostile $(PARTS); code=$$?; \
	    $(BIN)/python -m reports survival --out-dir results/survival --quiet && exit $$code

# In an environment of its own: cosmic-ray mutates the source, and imports nothing of it.
mutants: dev
	@test -x .cache/mutants/bin/cosmic-ray || { $(PYTHON) -m venv .cache/mutants && \
	    .cache/mutants/bin/pip install --quiet --disable-pip-version-check cosmic-ray==8.7.0; }
	@nice -n 15 $(BIN)/python tests/mutants/run.py --cosmic-ray "$(CURDIR)/.cache/mutants/bin/python" \
	    --count $(or $(COUNT),200)

# Pins that still fit stay; those of the tools agree with those of users.
LOCK = CUSTOM_COMPILE_COMMAND="make lock" .cache/lock/bin/pip-compile --quiet --strip-extras --allow-unsafe \
    --generate-hashes --no-annotate --no-emit-index-url --no-emit-trusted-host --no-emit-find-links --no-emit-options
# Extras that name others name the package itself, which no lock has to hold.
ITSELF := '/^metacloak @/d; /^\# WARNING: pip install will/d; /^\# Consider using a hashable/d'
lock: setup
	@test -x .cache/lock/bin/pip-compile || { $(PYTHON) -m venv .cache/lock && .cache/lock/bin/pip install --quiet pip-tools; }
	$(LOCK) --extra all --extra install --output-file requirements.lock pyproject.toml
	sed -i $(ITSELF) requirements.lock
	$(LOCK) --extra dev --constraint requirements.lock --output-file requirements-dev.lock pyproject.toml
	sed -i $(ITSELF) requirements-dev.lock
	$(BIN)/python -c "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['optional-dependencies']['compiler'], sep='\n')" \
		| $(LOCK) --output-file requirements-compiler.lock -

clean:
	rm -rf results .cache .snakemake .hypothesis .mypy_cache .pytest_cache .ruff_cache
