# `make demo` and `make test` do all the set-up themselves. What each target is for: `make help`.

PYTHON ?= python3
# Python of Ubuntu 24.04, on which Jazzy runs; where this machine has none, the second test run is left out, said aloud.
ifndef JAZZY_PYTHON
JAZZY_PYTHON := $(shell .ci/find-python 3.12)
endif
# Pythons beside those of `make test` for which ROS has wheels.
VERSIONS ?= 3.10 3.13
# Processes that run tests side by side: many of them wait for most of their time.
JOBS ?= 4

SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help venv tools second-tools demo test lint ament-lint docs pytest second-run colcon recipe versions hardening error-rate clean distclean

# The ROS wheels set this for their own children; in a child of another virtual environment it makes the wrong
# libraries load.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE

# A sourced ROS (apt's) is used as it is: no wheels, and the NumPy its messages are compiled against, for which there
# are no type stubs.
ifdef ROS_DISTRO
ROS := -c requirements/jazzy.txt
TOOLS := test
else
ROS := -r requirements/ros.txt
TOOLS := docs,lint,test
endif
PIP_INSTALL := -m pip install -qq $(INSTALL_FLAGS) -c requirements/constraints.txt
REQUIREMENTS := setup.py setup.cfg $(wildcard requirements/*.txt)
COLCON := out/colcon
# Files and folders of tests that `make colcon` leaves to `make pytest`: what depends on the versions of Python and
# NumPy is in the others, and in the nodes.
ONCE := $(foreach name,angles bag_player check_live console_after console_inputs doctor footprint foxglove_bridge hand_may_touch imu_mounting kills layers levels monitor_control \
    monitor_inputs motion_desk ok operator own_description packbot_simulator page_of_ parameter_types plain_english recipe recorder relaxed restarted robot_listener run_verb soak \
    stamps tell termination viewers words, \
    '--ignore-glob=*test_$(name)*') \
    $(foreach folder,advice bench campaign cases chassis cli configure console drill effort error_rate hardening inspection monitoring offline plan \
    report run simulation studies, \
    '--ignore-glob=*test/$(folder)/*' '--ignore-glob=*test/evaluation/$(folder)/*')
INSTALLED := $(COLCON)/install/ugv_acceptance

help:
	@echo 'make venv       .venv with the command .venv/bin/ugv-acceptance: 0.7 GB, 1 to 6 minutes'
	@echo 'make tools      the same and what the tests and lint need: 1.6 GB, 2 to 18 minutes'
	@echo 'make demo       the main job on a recorded run: live margins and alerts, then the verdict on the bag'
	@echo 'make test       everything CI checks: lint, the tests here, the tests on Python 3.12 + NumPy 1.26'
	@echo 'make lint       ruff and mypy --strict'
	@echo 'make ament-lint ROS'\''s own linters on what is installed on a robot, with our settings'
	@echo 'make docs       the documentation as a site, out/site/index.html; a warning is an error'
	@echo 'make pytest     the tests on $(PYTHON) alone; ARGS="-k stability" chooses some'
	@echo 'make colcon     colcon build and colcon test on Python 3.12 + NumPy 1.26, as on a robot'
	@echo 'make recipe     what README.md says for a robot, command by command, with colcon from apt'
	@echo 'make versions   the tests, but for the browser, on $(VERSIONS), the oldest with NumPy 1.26; ARGS as above'
	@echo 'make hardening  the faults of docs/threats.md, tried by the thousand: see ARGS=--help; ARGS="--only 1,2"'
	@echo 'make error-rate how often a verdict is wrong: 4,000 runs, half of them faulted, goes on where it was; ARGS="--short"'
	@echo 'make clean      removes what was built; make distclean the virtual environments too'

venv: .venv/.installed

tools: .venv/.tools

.venv/.installed: $(REQUIREMENTS)
	@echo 'Installing what is needed into .venv: 0.7 GB, 1 to 6 minutes.'
	test -x .venv/bin/python || $(PYTHON) -m venv .venv
	.venv/bin/python $(PIP_INSTALL) $(ROS) -e '.[console,fast,init,sim]'
	test -x .venv/bin/ugv-acceptance
	touch $@

# In one go where nothing is there yet.
.venv/.tools: $(REQUIREMENTS)
	@echo 'Installing what is needed and what the tests need into .venv: 1.6 GB, 2 to 18 minutes.'
	test -x .venv/bin/python || $(PYTHON) -m venv .venv
	.venv/bin/python $(PIP_INSTALL) $(ROS) -e '.[console,fast,init,sim,$(TOOLS)]'
	test -x .venv/bin/ugv-acceptance
	touch $@ .venv/.installed

.venv312/.installed: $(REQUIREMENTS)
	@test -n '$(JAZZY_PYTHON)' || { echo 'expected a python3.12 on PATH, in pyenv or in uv, found none'; exit 1; }
	@echo 'Installing what is needed and what the tests need into .venv312: 1.6 GB, 2 to 18 minutes.'
	test -x .venv312/bin/python || $(JAZZY_PYTHON) -m venv .venv312
	.venv312/bin/python $(PIP_INSTALL) -c requirements/jazzy.txt $(ROS) \
	    -e '.[console,fast,init,sim,test]' colcon-common-extensions
	touch $@

# The pip that comes with 3.10 searches for over ten minutes before it finds versions that fit.
.venv3%/.installed: $(REQUIREMENTS)
	@python=$$(.ci/find-python 3.$*) || { echo 'expected a python3.$* on PATH, in pyenv or in uv, found none'; exit 1; }; \
	test -x .venv3$*/bin/python || "$$python" -m venv .venv3$*
	.venv3$*/bin/python -m pip install -qq --upgrade pip
	.venv3$*/bin/python $(PIP_INSTALL) $(if $(filter 10,$*),-c requirements/jazzy.txt) -r requirements/ros.txt \
	    -e '.[console,fast,init,sim,test]'
	touch $@

demo: venv
	.venv/bin/ugv-acceptance demo

test: lint docs pytest second-run

ifneq ($(JAZZY_PYTHON),)
second-tools: .venv312/.installed
second-run: colcon
else
second-tools:
second-run:
	@echo '*** NOT DONE: the second run, on Python 3.12 + NumPy 1.26: no python3.12 on PATH, in pyenv or in uv.'
	@echo '*** NOT DONE: `make colcon JAZZY_PYTHON=/path/to/python3.12` makes it.'
	@test -z "$${CI:-}" || { echo '*** CI needs that run.'; exit 1; }
endif

ifdef ROS_DISTRO
docs:
	@echo '*** NOT DONE: docs: run it in a shell without ROS.'
lint:
	@echo '*** NOT DONE: lint: it needs a newer NumPy than the sourced ROS; run it in a shell without ROS.'
else
lint: tools
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy

docs: tools
	.venv/bin/python -m sphinx -W --keep-going -q -b html docs out/site
	@echo 'The documentation: out/site/index.html'
endif

# As `rosdep install` brings them, or from wheels in an environment of their own. A code that is left out here ruff checks.
ament-lint:
	command -v ament_flake8 ament_pep257 > /dev/null || { echo 'expected ament_flake8 and ament_pep257 on PATH: rosdep install brings them'; exit 1; }
	@mkdir -p out
	ament_flake8 --config requirements/ament_flake8.ini ugv_acceptance launch setup.py
	ament_pep257 --add-ignore D213 D301 D401 D402 D403 D413 -- ugv_acceptance launch setup.py > out/ament_pep257.txt || { grep -v '^checking' out/ament_pep257.txt; exit 1; }

pytest: tools
	.venv/bin/python -m pytest -n $(JOBS) --dist worksteal $(ARGS)

colcon: export PATH := $(CURDIR)/.venv312/bin:$(PATH)

# Tests that need a browser, and the long ones of whole processes over DDS, run once, in `make pytest`. Unless it is asked, colcon takes failing tests for a success; no test at all is one to it in any case.
colcon: .venv312/.installed
	colcon --log-base $(COLCON)/log build \
	    --build-base $(COLCON)/build --install-base $(COLCON)/install --event-handlers console_direct+
	test -x $(INSTALLED)/lib/ugv_acceptance/ugv-acceptance
	test -x $(INSTALLED)/lib/ugv_acceptance/acceptance_monitor
	test -f $(INSTALLED)/share/ament_index/resource_index/packages/ugv_acceptance
	set +u; . $(COLCON)/install/setup.sh; cd /; '$(CURDIR)/$(INSTALLED)/lib/ugv_acceptance/ugv-acceptance' model > /dev/null
	colcon --log-base $(COLCON)/log test \
	    --build-base $(COLCON)/build --install-base $(COLCON)/install --test-result-base $(COLCON)/build \
	    --event-handlers console_direct+ --return-code-on-test-failure \
	    --pytest-args -n $(JOBS) --dist worksteal --no-cov --hypothesis-profile=again $(ONCE) $(ARGS)
	colcon --log-base $(COLCON)/log test-result --test-result-base $(COLCON)/build | tee $(COLCON)/summary.txt
	@grep -q '^Summary: [1-9]' $(COLCON)/summary.txt || { echo 'colcon test: expected tests, none ran'; exit 1; }

# Not the Makefile's virtual environments but the system's Python, which apt's colcon runs on.
recipe:
	/usr/bin/python3 test/robot_recipe.py

versions: $(foreach version,$(VERSIONS),.venv$(subst .,,$(version))/.installed)
	failed=0; for version in $(VERSIONS); do \
	    ".venv$${version/./}/bin/python" -m pytest -n $(JOBS) --dist worksteal '--ignore-glob=*test_page_of_*' $(ARGS) || failed=1; \
	done; exit $$failed

hardening: tools
	.venv/bin/python -m bench.hardening $(ARGS)

error-rate: tools
	.venv/bin/python test/error_rate $(ARGS)

clean:
	rm -rf out build install log *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -path './.venv*' -prune -o -name __pycache__ -type d -print0 | xargs -0 rm -rf

distclean: clean
	rm -rf .venv .venv3*
