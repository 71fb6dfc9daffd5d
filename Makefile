# `make demo` and `make test` set everything up first; a second run starts at once.
.PHONY: demo test quick check tests lock

demo: .venv/ready
	.venv/bin/capture-plan demo -o out/demo

# Two workers, each of one thread: more would wait for each other where there are two cores. Shapes and types of what
# every function takes and returns are checked in the tests of short computations: it takes as long as the computing.
PYTEST = OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 .venv/bin/pytest -n 2 --dist worksteal
CHECKED = $(addprefix tests/,anatomy/test_blendshape_pairs.py anatomy/test_zones.py \
	evaluation/test_identifiability.py face/test_skin.py layout/test_lower_bound.py layout/test_predict.py \
	layout/test_sites.py layout/test_weight_recovery.py mesh/test_mesh.py registration/test_nonrigid_icp.py \
	shell/test_shell_model.py shell/test_shell_motion.py shell/test_shell_state.py transfer/test_deformation.py \
	transfer/test_score.py visibility/test_visibility.py)
OTHERS = $(filter-out $(CHECKED),$(sort $(wildcard tests/test_*.py tests/*/test_*.py tests/*/*/test_*.py)))

# What a change asks for first, for a minute at most: `make test` is the whole truth.
quick: .venv/ready
	.venv/bin/ruff check .
	$(PYTEST) --within 45 $$(.venv/bin/python -m tests.changed)

# Neither the tests nor the checks of the code keep two cores busy alone.
test: .venv/ready
	$(MAKE) -j 2 check tests

tests: .venv/ready
	$(PYTEST) $(OTHERS)
	$(PYTEST) --jaxtyping-packages=capture_plan,beartype.beartype $(CHECKED)

check: .venv/ready
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/pyright
	.venv/bin/marimo check notebooks/*.py notebooks/learn/*.py

.venv/ready: requirements.lock pyproject.toml .ci/setup
	bash .ci/setup

lock: .venv/ready
	.venv/bin/uv pip compile --generate-hashes --no-emit-index-url --no-header --universal --extra dev pyproject.toml -o requirements.lock
