# make demo: the whole loop on shipped data; make test: the tests; make verify: VERIFICATION.md; make check: style, types,
# import rules, documentation; make docs: the documentation; make docs-run: its commands; make session: its terminal sessions.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
OUT := demo_out

.DEFAULT_GOAL := help
.PHONY: help install demo test kernels check docs docs-run tour session bench fuzz verify clean

help:
	@echo "make demo    install, then run the whole loop on shipped data; ends with the effect that the model lacks"
	@echo "make test    install, then run the tests"
	@echo "make kernels install, then compile the solver's kernels into their cache"
	@echo "make check   style, types, import rules, and the documentation builds"
	@echo "make docs    the documentation, into site/index.html"
	@echo "make docs-run  every command of README.md and docs/ as it stands there (make test runs those that cost little)"
	@echo "make tour    run the notebook docs/tour.ipynb anew"
	@echo "make session run the terminal sessions of README.md and docs/ anew (about 25 minutes on 2 cores)"
	@echo "make bench   timings (tests/benchmarks)"
	@echo "make fuzz    3000 random cases, settings, command lines and records (make test runs 60)"
	@echo "make verify  VERIFICATION.md: the solver against theory and other codes (1 to 2 hours on 2 cores; resumes)"
	@echo "make clean   remove what make demo and the tests wrote; the environment stays"

install: $(STAMP)

# Editable: the kernels' compiled code is cached beside their sources and serves the demo and the tests alike.
$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "birdstrike needs Python 3.11 or newer, but $(PYTHON) is" \
	    "$$($(PYTHON) --version 2>&1); try: make $(MAKECMDGOALS) PYTHON=/path/to/python3.11"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev]"
	@touch $@

demo: install
	@echo "A shot and a baseline of one rig, simulated by OpenRadioss, not measured; the shot has something that its set-up does"
	@echo "not declare. The model has 1500 particles and 1080 shells: data/cases/demo_rig.toml says why."
	$(BIN)/birdstrike close-the-loop demo_rig --measured openradioss_speed96 --baseline openradioss_clean1 --out $(OUT)

test: install
	$(BIN)/python -m pytest -n 2 --dist loadscope

# What the tests would otherwise compile on a new checkout.
kernels: install
	$(BIN)/python -m tests.compile_kernels

check: install
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/basedpyright --threads 2
	$(BIN)/lint-imports
	$(MAKE) --no-print-directory docs

docs: install
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going -b html -d site/.doctrees docs site

docs-run: install
	$(BIN)/python docs/run_commands.py

# In a folder of its own, because the notebook writes its results beside itself.
tour: install
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[notebook]"
	mkdir -p $(OUT)/tour && cp docs/tour.ipynb $(OUT)/tour/ && \
	  $(BIN)/jupyter-execute --inplace $(OUT)/tour/tour.ipynb && cp $(OUT)/tour/tour.ipynb docs/

session: install
	$(BIN)/python docs/make_session.py

# The peer is optional: where it does not install, its comparison is skipped.
bench: install
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[bench]" || \
	  echo "not all peers could be installed: their rows say so"
	$(BIN)/python -m pytest tests/benchmarks --override-ini addopts=--import-mode=importlib -s

fuzz: install
	BIRDSTRIKE_FUZZ=600 $(BIN)/python -m pytest tests/solver/case/test_random_cases.py tests/solver/case/test_random_keys.py \
	  tests/cli/test_random_commands.py tests/data/test_random_records.py --hypothesis-show-statistics

verify: install
	$(BIN)/birdstrike verify

clean:
	rm -rf $(OUT) site .verification .pytest_cache .ruff_cache .hypothesis .import_linter_cache build *.egg-info
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
