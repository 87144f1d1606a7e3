# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
# Needs a Python of the versions below and nothing else; everything is installed into virtual environments in this folder.

SHELL := /bin/bash
.DEFAULT_GOAL := help

VERSIONS := 3.12 3.13 3.11 3.10
# numba 0.59, which Ubuntu 24.04 ships, knows Python up to 3.12.
UBUNTU_VERSIONS := 3.12 3.11 3.10
PYTHON ?= $(shell scripts/find_python.sh $(VERSIONS))

VENV := $(CURDIR)/.venv
UBUNTU := $(CURDIR)/.venv-ubuntu
KILTED := $(CURDIR)/.venv-kilted
STEP := scripts/step.sh
PIP_FLAGS := --quiet --disable-pip-version-check --prefer-binary
DECLARED := setup.py setup.cfg package.xml
SOURCES := $(shell find topo_region_seg launch config rviz foxglove security resource -type f -not -path '*/__pycache__/*')

# rclpy's wheels make the environment a ROS prefix: it is where the ament index is looked up.
export ROS_PYTHON_CHECK_FIELDS := 1
export PYTHONUNBUFFERED := 1
in_venv = env AMENT_PREFIX_PATH=$(1) PATH="$(1)/bin:$$PATH"

.PHONY: help demo test test-ubuntu test-kilted fuzz nightly mutants load soak lint types format docs site linkcheck bench bench-quick beyond worst pictures clean

help: ## Show what can be made.
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/  make \1\t\2/' | expand -t 22

demo: .venv/ready-demo ## Segment a real RGB-D frame and a made sequence with the node, over DDS.
	@$(STEP) "demo" $(call in_venv,$(VENV)) $(VENV)/bin/python -m topo_region_seg.offline.demo

test: lint ## Lint, types and the whole test suite, with a colcon build.
	@$(STEP) "tests" $(call in_venv,$(VENV)) $(VENV)/bin/python -m pytest

# Against an installed copy, not these sources: that tries the wheel too, and keeps its compiled kernels apart from .venv's.
# Left out is what no version of numpy, scipy or numba changes, and what brings its own environment.
ELSEWHERE := test_architecture test_colcon test_killed ros/test_launch offline/report/test_report_browser test_security \
  ros/test_player ros/test_outputs ros/test_ros_lifecycle offline/evaluation/test_cluster test_benchmarks test_speedup test_tricks test_benchmark_objects \
  test_beyond test_soak offline/test_demo \
  test_documents
test-ubuntu: .venv-ubuntu/ready-package ## The tests, with the numpy, scipy and numba of Ubuntu 24.04.
	@$(STEP) "tests with what Ubuntu 24.04 ships" $(call in_venv,$(UBUNTU)) PYTHONSAFEPATH=1 $(UBUNTU)/bin/python -m pytest -p no:cacheprovider $(ELSEWHERE:%=--ignore=test/%.py)

# What needs interface packages is left out: their generators come with Jazzy's wheels alone.
test-kilted: .venv-kilted/ready-test ## The tests of the node with ROS 2 Kilted's rclpy and Fast DDS 3.
	@$(STEP) "tests of the node with Kilted" $(call in_venv,$(KILTED)) $(KILTED)/bin/python -m pytest -p no:cacheprovider test/ros

fuzz: .venv/ready-test ## Minutes of arbitrary messages for the decoder, the second half guided by coverage.
	@$(STEP) "installing atheris" $(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[fuzz]'
	@$(STEP) "100,000 generated and 600,000 random messages" env FUZZ_CASES=100000 $(VENV)/bin/python -m pytest -q test/cloud/test_fuzz.py
	@mkdir -p build/fuzz
	@$(STEP) "ten minutes of atheris" env PYTHONPATH=. $(VENV)/bin/python test/fuzz/fuzz_decode.py -max_total_time=600 \
	  -artifact_prefix=build/fuzz/ build/fuzz

nightly: .venv/ready-test ## Kill node, replay and compiler 50 times each at random moments.
	@$(STEP) "50 kills" $(call in_venv,$(VENV)) KILLS=50 $(VENV)/bin/python -m pytest -q test/test_killed.py

mutants: .venv/ready-test ## Wrong changes one at a time: do the tests notice? Hours; continues where it stopped.
	@$(STEP) "mutants" $(call in_venv,$(VENV)) $(VENV)/bin/python scripts/mutants.py

lint: .venv/ready-test ## ruff, mypy and the ament linters.
	@$(STEP) "lint" $(call in_venv,$(VENV)) scripts/lint.sh

format: .venv/ready-test ## Lay out the source.
	@$(VENV)/bin/ruff check --fix-only --quiet . ; $(VENV)/bin/ruff format .

docs: .venv/ready-demo ## Write the generated parts of docs/ and config/.
	@$(STEP) "generated parts of the documents" $(VENV)/bin/python scripts/write_documents.py

site: .venv/ready-docs ## Build the documentation as a site in build/site; warnings are errors.
	@$(STEP) "site in build/site/index.html" $(VENV)/bin/python -m sphinx -W --keep-going -n -q -d build/site-cache docs build/site

linkcheck: .venv/ready-docs ## Try the links that lead out of the documentation; needs a network.
	@$(STEP) "external links" $(VENV)/bin/python -m sphinx -q -b linkcheck -d build/site-cache docs build/linkcheck

bench: .venv/ready-bench ## Measure everything, beside other programs; writes docs/benchmarks.md.
	@$(STEP) "benchmarks" $(call in_venv,$(VENV)) $(VENV)/bin/python -m benchmarks --publish

load: .venv/ready-test ## Measure the node beside cameras, under five minutes; writes docs/load.md.
	@$(STEP) "the node under load" $(call in_venv,$(VENV)) $(VENV)/bin/python -m benchmarks.load

soak: .venv/ready-demo ## Twice ten minutes of trouble for one node; writes docs/soak.md.
	@$(STEP) "soak test, ten minutes" $(call in_venv,$(VENV)) $(VENV)/bin/python -m benchmarks.soak --minutes 10
	@$(STEP) "soak test with depth images, ten minutes" $(call in_venv,$(VENV)) $(VENV)/bin/python -m benchmarks.soak --minutes 10 --input depth

bench-quick: .venv/ready-bench ## The same in two minutes, to benchmarks/results/.
	@$(STEP) "benchmarks, quick" $(call in_venv,$(VENV)) $(VENV)/bin/python -m benchmarks --quick

worst: .venv/ready-bench ## Measure frames that leave much to do; writes docs/worst_frames.md.
	@$(STEP) "worst frames" $(call in_venv,$(VENV)) $(VENV)/bin/python -m benchmarks.worst_frames

beyond: .venv/ready-bench ## Measure what goes beyond the paper; writes the tables of docs/.
	@$(STEP) "objects, scale, tracks, supervoxels, steadiness" $(call in_venv,$(VENV)) $(VENV)/bin/python -m benchmarks.beyond --publish

pictures: .venv/ready-demo ## Make the pictures of the documentation.
	@$(STEP) "pictures" $(VENV)/bin/python docs/make_pictures.py

clean: ## Remove the environments and everything made.
	rm -rf .venv .venv-ubuntu .venv-kilted build install log dist demo_output *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The stamps: made again when what the package declares changes.
.venv/bin/python:
	@test -n "$(PYTHON)" || exit 1
	@$(STEP) "virtual environment .venv with $(PYTHON)" $(PYTHON) -m venv $(VENV)

.venv/ready-demo: .venv/bin/python $(DECLARED)
	@$(STEP) "installing the package, rclpy and Fast DDS into .venv (once; about 300 MB)" \
	  $(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[ros,demo]'
	@touch $@

.venv/ready-test: .venv/ready-demo
	@$(STEP) "installing the test tools into .venv (once)" \
	  $(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[ros,interfaces,demo,test,lint]'
	@touch $@

.venv/ready-docs: .venv/ready-demo
	@$(STEP) "installing Sphinx into .venv (once)" \
	  $(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[ros,demo,docs]'
	@touch $@

.venv/ready-bench: .venv/ready-demo
	@$(STEP) "installing the programs to compare with into .venv (once; Open3D is 400 MB)" \
	  $(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[ros,demo,bench]'
	@touch $@

.venv-ubuntu/ready-test: $(DECLARED) constraints/ubuntu-24.04.txt
	@python=$$(scripts/find_python.sh $(UBUNTU_VERSIONS)) && \
	  $(STEP) "virtual environment .venv-ubuntu with $$python" $$python -m venv --clear $(UBUNTU)
	@$(STEP) "installing what Ubuntu 24.04 ships, rclpy and the test tools into .venv-ubuntu (once)" \
	  $(UBUNTU)/bin/python -m pip install $(PIP_FLAGS) -c constraints/ubuntu-24.04.txt setuptools '.[ros,demo,test]'
	@touch $@

.venv-kilted/ready-test: $(DECLARED)
	@test -n "$(PYTHON)" || exit 1
	@$(STEP) "virtual environment .venv-kilted with $(PYTHON)" $(PYTHON) -m venv --clear $(KILTED)
	@$(STEP) "installing the package, Kilted's rclpy and Fast DDS, and pytest into .venv-kilted (once)" \
	  $(KILTED)/bin/python -m pip install $(PIP_FLAGS) -e '.[ros-kilted,test]'
	@touch $@

.venv-ubuntu/ready-package: .venv-ubuntu/ready-test $(SOURCES)
	@rm -rf build/lib build/bdist.*
	@$(STEP) "installing the package into .venv-ubuntu" \
	  $(UBUNTU)/bin/python -m pip install $(PIP_FLAGS) --no-deps --force-reinstall .
	@rm -rf build/lib build/bdist.*
	@touch $@
