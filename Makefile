PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: all demo studio test suite lint docs bench figures fem proof hidden next-test cosim cosim-all bench-demo faults endurance soak \
	measured package release clean

all: $(STAMP)

$(STAMP): pyproject.toml .ci/constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed")'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --constraint .ci/constraints.txt --editable ".[fmu,bench,studio,cosim,fleet,delta,docs,dev]"
	touch $@

# The main job, end to end, on the numerical rig; ends by naming the files to open.
demo: $(STAMP)
	$(BIN)/python build/demo.py

# The journey in the browser, on a virtual tire with a hidden effect, which the rig measures first.
studio: $(STAMP)
	test -d build/out/example || $(BIN)/tirelib rig --plan short --hide sidewall_damping=0.05 --out build/out/example
	$(BIN)/tirelib studio build/out/example

# The checks of the source take one core for a minute: they run beside the tests.
test: $(STAMP)
	$(MAKE) --jobs=2 lint suite

# A file to each process; one process more than cores, as tests of the bench and the browser wait.
# In the order of the folders: what is short, tests/unit, comes last; files that wait are spread among
# the others (tests/conftest.py). One thread in each process. Memory in large pages, which a process
# keeps: a tenth less processor time; what is not Linux with glibc reads no such variable.
KEPT := glibc.malloc.hugetlb=1:glibc.malloc.mmap_threshold=33554432:glibc.malloc.trim_threshold=1073741824
suite: $(STAMP)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 GLIBC_TUNABLES=$(KEPT) PYTHONDONTWRITEBYTECODE= \
		$(BIN)/python -m pytest --dist=loadfile --no-loadscope-reorder --numprocesses=$$($(BIN)/python -c "import os; print(os.cpu_count() + 1)")

lint: $(STAMP)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

# Runs the tutorials and shows them with their figures; about two minutes of one core.
docs: $(STAMP)
	$(BIN)/sphinx-build --fail-on-warning --quiet docs build/out/docs
	@echo "open build/out/docs/index.html"

# Timed, with ratios within one run; never part of `make test`.
bench: $(STAMP)
	$(BIN)/python -m pytest tests/speed -m speed --benchmark-columns=min,median,max,rounds

# Draws the figures of the dissertation's chapters 5 and 6 from the models.
figures: $(STAMP)
	$(BIN)/python build/figures.py

# Makes the finite-element reference data anew; needs CalculiX (Debian: calculix-ccx).
fem: $(STAMP)
	$(BIN)/python build/fem/run.py

# Coverage of the identification's intervals on random tires of the numerical rig; an hour.
proof: $(STAMP)
	$(BIN)/python build/proof/run.py

# Hides effects in tires of three simulators, lets the library find them, and counts; hours, resumable.
hidden: $(STAMP)
	for family in rig continuum ring; do \
		$(BIN)/python build/structure/make.py --family $$family --seeds table; \
		$(BIN)/python build/structure/make.py --family $$family --seeds 101-170 --kinds known; \
		$(BIN)/python build/structure/make.py --family $$family --seeds 201-230 --kinds unknown; \
	done
	$(BIN)/python build/structure/learn.py
	$(BIN)/python build/structure/judge.py --jobs 2

# How often the run that next-test advises tells two look-alikes apart; an hour, resumable.
next-test: $(STAMP)
	$(BIN)/python build/next_test/run.py --seeds 6100-6106
	$(BIN)/python build/next_test/run.py --scattered --seeds 6100-6102

# A vehicle on four virtual tires, told by four strain tires; exit code 1 while a figure is missed.
cosim: $(STAMP)
	$(BIN)/python build/cosim/run.py

# The same, and braking on a split road, which takes as long as all the rest.
cosim-all: $(STAMP)
	$(BIN)/python build/cosim/run.py --all

# The bench end to end: emulator, live page, recording, replay, campaign, comparison.
bench-demo: $(STAMP)
	$(BIN)/python build/bench_demo.py

# Ten minutes live on each line, a hundred cables pulled, processes killed; half an hour.
endurance: $(STAMP)
	$(BIN)/python build/bench_endurance.py

# A simulated day of one wheel, as fast as it goes; over an hour.
soak: $(STAMP)
	$(BIN)/python build/bench_soak.py

# A million damaged frames on a serial line: none may pass, few good ones may be lost.
faults: $(STAMP)
	$(BIN)/python build/bench_faults.py

# Every figure of the estimators, the co-simulations and the bench, one after the other; hours, on a quiet machine.
measured: $(STAMP)
	$(BIN)/python build/measure_again.py

# The wheel in an empty environment and an empty folder: every verb of the core, then the bench's extra.
package: $(STAMP)
	$(BIN)/python build/package.py

# Versions that agree, nothing uncommitted, then `make package`; the wheel stays in build/out/release.
release: $(STAMP)
	$(BIN)/python build/release.py

clean:
	rm -rf build/out .pytest_cache .mypy_cache .ruff_cache
