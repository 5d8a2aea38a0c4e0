# `make` lists the targets. Everything runs in .venv, which `make setup` fills once.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help demo test test-all test-extras check format lock setup extras peers wheel clean

export PATH := $(CURDIR)/.venv/bin:$(PATH)
unexport PYTHONPATH PYTHONHOME
PACKAGES := kb planner grounding executive sim tests
STAMP := .venv/.complete

help: ## list the targets
	@sed -nE 's/^([a-z-]+):.*## (.*)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 18

demo: $(STAMP) ## two simulated robots look for an empty drink
	concertmaster run FindEmptyDrink room=tue_lab --robots 2 --site tue_lab

test: check ## the checks and the tests, in a few minutes
	pytest -n auto --dist worksteal -m "not slow and not node and not ros1 and not ros2 and not ray"

test-all: check ## the checks and all tests, the slow ones and those of the extras too
	pytest -n auto --dist worksteal

EXTRAS ?= node or ros1 or ros2 or ray
test-extras: $(STAMP) ## the tests of what is optional: Node.js clients of rosbridge, ROS 1, ROS 2, Ray
	pytest -m "$(EXTRAS)"

check: $(STAMP) ## lint, format, types, layers
	ruff check $(PACKAGES)
	ruff format --check $(PACKAGES)
	mypy
	lint-imports

format: $(STAMP) ## format and mend what can be mended by itself
	ruff check --fix $(PACKAGES)
	ruff format $(PACKAGES)

lock: $(STAMP) ## write requirements.lock anew from pyproject.toml, with the newest versions
	pip-compile --quiet --upgrade --extra dev --all-build-deps --allow-unsafe --generate-hashes --strip-extras \
		--no-emit-find-links --no-emit-index-url --no-emit-trusted-host --output-file requirements.lock pyproject.toml

setup: $(STAMP) ## make .venv: Python packages and SWI-Prolog

$(STAMP): pyproject.toml requirements.lock .ci/setup .ci/packages
	.ci/setup
	touch $@

extras: ## install what is optional, as far as that is possible here: Node.js, ROS 1, ROS 2, Ray
	.ci/extras

peers: $(STAMP) ## install up-tamer, which the planner's benchmark compares with (its licence: educational use)
	pip install --no-deps up-tamer==1.1.6 pytamer==0.1.22

wheel: $(STAMP) ## build dist/*.whl
	python -m build --wheel --no-isolation

clean: ## remove everything that can be made again
	rm -rf .venv build dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
