# `make demo` and `make test` do all the set-up they need: a checkout, cargo, C and C++ compilers and python3
# suffice. One build profile serves everything, so a clean checkout compiles its dependencies once.

CARGO ?= cargo
RELEASE := $(or $(CARGO_TARGET_DIR),target)/release
.DEFAULT_GOAL := help
.PHONY: help setup build demo test bench bench-parts lint

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-11s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## Fetch MuJoCo's library (once) into .mujoco/run-make-setup
	@command -v $(CARGO) >/dev/null || { echo "make: cargo is missing: see https://rustup.rs" >&2; exit 1; }
	@command -v cc >/dev/null || { echo "make: a C compiler (cc) is missing" >&2; exit 1; }
	@command -v c++ >/dev/null || { echo "make: a C++ compiler (c++) is missing" >&2; exit 1; }
	@scripts/setup-mujoco

build: setup ## Build target/release/mikoshi and the services beside it
	$(CARGO) build --release --workspace --bins

demo: build ## Four robots walk and carry one object
	$(RELEASE)/mikoshi run config/scenarios/transport.toml

test: build ## Run every test
	$(CARGO) test --release --workspace
	@scripts/test-log-readers

bench: setup ## Run the benchmarks
	$(CARGO) bench --workspace

bench-parts: build ## Time the parts of a tick, kinematics beside Pinocchio's (which is fetched from PyPI, once)
	@scripts/setup-pinocchio
	MIKOSHI_PINOCCHIO="$(abspath $(or $(CARGO_TARGET_DIR),target))/pinocchio" $(CARGO) bench --workspace --bench parts

lint: setup ## Formatting, clippy, and dependency rules where cargo-deny is installed
	$(CARGO) fmt --all --check
	$(CARGO) clippy --release --workspace --all-targets -- -D warnings
	@if $(CARGO) deny --version >/dev/null 2>&1; then $(CARGO) deny --all-features check; \
	else echo "lint: cargo-deny is not installed, dependency rules are not checked"; fi
