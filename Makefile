# `make demo` and `make test` set everything up first; a second run starts at once.
.PHONY: demo test check tests lock

demo: .venv/ready
	.venv/bin/capture-plan demo -o out/demo

# Two workers, each of one thread: more would wait for each other where there are two cores. Shapes and types of what
# every function takes and returns are checked in the tests of short computations: it takes as long as the computing.
PYTEST = OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 .venv/bin/pytest -n 2 --dist worksteal
CHECKED = $(patsubst %,tests/test_%.py,deformation mesh observe pairs predict reconstruct register relaxation score \
	sites skin shell_model shell_motion shell_state visibility zones)
OTHERS = $(filter-out $(CHECKED),$(wildcard tests/test_*.py tests/benchmarks/test_*.py))

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
	.venv/bin/marimo check notebooks/*.py

.venv/ready: requirements.lock pyproject.toml .ci/setup
	bash .ci/setup

lock:
	uv pip compile --generate-hashes --no-emit-index-url --no-header --universal --extra dev pyproject.toml -o requirements.lock
