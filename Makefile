# `make help` lists the targets. Everything is installed into .venv and written to out.

RUN     := .venv/bin/mitsuba-diffraction
PYTHON3 := .venv/bin/python
# the scenes' own patch is the same recipe; relative to the scene
RENDER  := $(RUN) render -D patch=../out/elaphe_like.exr

.DEFAULT_GOAL := setup
.PHONY: setup extras demo test test-all fuzz package bench bench-gpu figures gallery evaluation methods sweeps tradeoff plan parameters notebooks blender blender-figures release site validation measured energy realtime lint clean help
MAKEFLAGS += --no-print-directory

setup: .venv/packages .venv/libraries  ## create .venv with the package, and an LLVM for Dr.Jit (default)
	@:

# stamps: done again only when what they depend on has changed
.venv/packages: pyproject.toml .ci/setup
	@.ci/setup packages

.venv/libraries: .venv/packages
	@.ci/setup libraries

.venv/browser: .venv/packages
	@.ci/setup browser

extras: .venv/extras  ## install what pictures may need: meshes of glTF and USD, films as MP4, denoising
	@:

.venv/extras .venv/validation: .venv/packages
	@.ci/setup $(notdir $@)

demo: setup  ## tabulate a snake scale, render three scenes with it, the snake in two lights
	@mkdir -p out
	@$(RUN) precompute precompute/elaphe_like.toml -o out/elaphe_like.exr
	@$(RENDER) scenes/plate.xml -s 64 -o out/plate.exr
	@$(RENDER) scenes/sphere.xml -s 32 -o out/sphere.exr
	@$(RENDER) scenes/snake.xml -s 32 -D sun_azimuth=120 -o out/snake.exr
	@$(RENDER) scenes/snake.xml -s 32 -D sun_azimuth=60 -o out/snake_other_light.exr
	@echo "Compare out/snake.png and out/snake_other_light.png: the colours move with the sun."

# one thread for linear algebra in each process; TIMES=1 prints the slowest tests
PYTEST := OPENBLAS_NUM_THREADS=1 $(PYTHON3) -m pytest --dist worksteal $(if $(TIMES),--durations=40)
test: setup .venv/browser  ## run the quick tests, of every part: three minutes
	@$(PYTEST) -n 2 -m "not thorough"

# three processes: browsers and workers of a cluster are waited for
test-all: setup .venv/browser  ## run all tests: ten minutes
	@$(PYTEST) -n 3

# for as long as you like: make fuzz SECONDS=600; the same cases again: make fuzz SEED=1 ROUNDS=20; one kind: KIND=energy
fuzz: setup  ## try random surfaces, damaged files and command lines for a minute
	@mkdir -p out/fuzz
	@MITSUBA_DIFFRACTION_CACHE=out/fuzz OPENBLAS_NUM_THREADS=1 $(PYTHON3) -W ignore -m tests.fuzz \
	    --seconds $(or $(SECONDS),60) $(if $(ROUNDS),--rounds $(ROUNDS)) $(if $(SEED),--seed $(SEED)) $(if $(KIND),--kind $(KIND))

package: setup .venv/browser  ## test wheel and sdist in empty environments, with oldest and newest packages
	@.ci/package

# ten minutes where a graphics card is, longer without one
bench-gpu: setup  ## measure a graphics card: eval, sample, pictures, frames, and pixels of the shaders
	@mkdir -p out
	@$(PYTHON3) -m docs.make.bench --only eval sample snake orders frames --json out/bench-gpu.json
	@$(PYTHON3) -m docs.make.figures.tables card out/bench-gpu.json
	@$(RUN) compare scenes/scales.xml --method fast exact -s 1024 --frames 512 --supersampling 2 -D resx=72 -D resy=48 \
	    -o out/compare/gpu

# with a patch of your own: make bench MEASURED="scale.png --pixel-size 0.0488 --max-height 0.375"
bench: setup  ## measure speed and noise: docs/performance.md
	@mkdir -p out
	@$(PYTHON3) -m docs.make.bench $(if $(MEASURED),--measured $(MEASURED)) --json out/bench.json
	@$(PYTHON3) -m docs.make.figures.tables speed out/bench.json

# a measured patch beside the look-alikes: make figures MEASURED="scale.png --pixel-size 0.0488 --max-height 0.375"
figures: setup  ## make the pictures in docs/images
	@$(PYTHON3) -m docs.make.figures.pictures -o docs/images $(if $(MEASURED),--measured $(MEASURED))

gallery: setup  ## make the pictures of docs/gallery.md and docs/meshes.md
	@$(PYTHON3) -m docs.make.figures.gallery -o docs

evaluation: setup  ## make docs/thesis.md: ridges, grating equation, fitted periods
	@$(PYTHON3) -m docs.make.figures.thesis evaluation $(if $(MEASURED),--measured $(MEASURED))

sweeps: setup  ## make docs/thesis.md: contact sheet of BRDF maps
	@mkdir -p out
	@$(RUN) sweep wavelength-step $(or $(MEASURED),precompute/elaphe_like.toml) --theta 30 --wavelength-range 380:780 \
	    --resolution 160 -o docs/images/sweep-wavelength-step.png --json out/sweep.json
	@$(PYTHON3) -m docs.make.figures.tables sweep out/sweep.json

methods: setup  ## measure the methods: docs/thesis.md
	@$(PYTHON3) -m docs.make.figures.thesis methods $(if $(MEASURED),--measured $(MEASURED))

tradeoff: setup  ## measure accuracy against speed and memory: docs/accuracy.md
	@$(RUN) tradeoff $(MEASURED) -o out/tradeoff
	@$(PYTHON3) -m docs.make.figures.tables tradeoff out/tradeoff

plan: setup  ## plan the snake's scene: docs/performance.md
	@mkdir -p out
	@$(RUN) plan scenes/snake.xml --json out/plan.json
	@$(PYTHON3) -m docs.make.figures.tables plan out/plan.json

parameters: setup  ## make docs/parameters.md, commands.md, python.md and formats.md of the code
	@$(PYTHON3) -m docs.make.figures.interfaces -o docs

notebooks: setup  ## run the notebooks, and keep what they show in their files
	@$(PYTHON3) -m docs.make.figures.notebooks

# an environment of its own: bpy needs NumPy below 2, and the Python that its version names
blender: .venv/blender/bin/python  ## install Blender as a Python module into .venv/blender (0.4 GB)
	@:

.venv/blender/bin/python: .ci/setup
	@.ci/setup blender

blender-figures: setup blender  ## compare Cycles with Mitsuba: docs/blender.md
	@$(PYTHON3) -m docs.make.figures.blender -o docs

# mkdocs loads the hooks of docs/make/site from here
site: setup  ## build the pages with an API reference: out/site/index.html
	@PYTHONPATH=. NO_MKDOCS_2_WARNING=1 $(PYTHON3) -W ignore -m mkdocs build --strict --quiet
	@echo "Open out/site/index.html"

release: setup  ## check and build a release into out/release; TESTS=1 tests the wheel, too
	@.ci/release

validation: setup .venv/validation  ## compare the model with rigorous solutions: docs/validation.md and docs/validation/
	@$(PYTHON3) -m docs.make.validation -o docs

# KAIST=FOLDER compares a clone of github.com/KAIST-VCLAB/color-brdfs-with-wave-optics too
measured: setup  ## compare model and solved orders with measured gratings: docs/validation/measured.md
	@OPENBLAS_NUM_THREADS=1 $(PYTHON3) -m docs.make.measured -o docs $(if $(KAIST),--kaist $(KAIST))

SURFACES := sinusoidal blazed cd cd_pits dvd_pits elaphe_like xenopeltis_like
energy: setup  ## measure what energy conservation takes: docs/energy.md
	@mkdir -p out/energy
	@for name in $(SURFACES); do \
	    $(RUN) precompute precompute/$$name.toml -o out/energy/$$name.exr && \
	    $(RUN) info --energy --json out/energy/$$name.json out/energy/$$name.exr || exit 1; done
	@$(PYTHON3) -m docs.make.figures.tables energy $(SURFACES:%=out/energy/%.json)

# scene, width, height, samples of the path tracer, frames, samples a frame along either side of a pixel
REALTIME := scales:36:24:16200:2048:2 snake:40:25:97200:3072:5 xenopeltis:32:20:96100:3072:3 \
    cd:36:26:48400:1024:3 grating:36:28:48400:1024:3 hologram:36:26:48400:1024:3 material_ball:30:27:48400:3072:3
# whether what a comparison wrote is no older than the code and the scenes
UP_TO_DATE = [ -e $(1) ] && [ -z "$$(find mitsuba_diffraction scenes precompute/*.toml Makefile -newer $(1) -type f ! -name '*.pyc' -print -quit)" ]
realtime: setup  ## compare the shaders with the path tracer: docs/realtime.md
	@for scene in $(REALTIME); do \
	    set -- $$(echo $$scene | tr : ' '); made=out/compare/$$1; \
	    if $(call UP_TO_DATE,$$made/compare.json); then echo "$$made is kept: no code or scene is newer"; \
	    else $(RUN) compare scenes/$$1.xml --method fast exact -s $$4 --frames $$5 --supersampling $$6 --full-spp 0 \
	        -D resx=$$2 -D resy=$$3 -o $$made; fi || exit 1; done
	@$(call UP_TO_DATE,out/compare/sheet/compare.json) || $(RUN) compare scenes/snake.xml --method fast -s 512 --full-spp 128 \
	    --frames 256 --supersampling 2 -D resx=320 -D resy=200 -o out/compare/sheet
	@$(PYTHON3) -m docs.make.figures.tables realtime --pictures out/compare/sheet $(foreach s,$(REALTIME),out/compare/$(firstword $(subst :, ,$s)))

lint: setup  ## check style, types and the layers of imports
	@$(PYTHON3) -m ruff check
	@$(PYTHON3) -m ruff format --check
	@$(PYTHON3) -m mypy
	@.venv/bin/lint-imports

clean:  ## remove .venv, out and all caches
	@rm -rf .venv out build dist precompute/tables .pytest_cache .mypy_cache .ruff_cache .hypothesis
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +

help:
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 20
