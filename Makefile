# `make demo` and `make test` do all the set-up they need: a checkout, cargo, C and C++ compilers and python3
# suffice. One build profile serves everything, so a clean checkout compiles its dependencies once.

CARGO ?= cargo
TARGET := $(or $(CARGO_TARGET_DIR),target)
RELEASE := $(TARGET)/release
# A workspace of its own, which shares what has been built.
PEERS := --release --manifest-path bench/peers/Cargo.toml --target-dir $(TARGET)
COMMA := ,
DDS = $(shell pkg-config --exists CycloneDDS && command -v idlc)
ALL_PEERS = --features zenoh$(if $(DDS),$(COMMA)dds)
.DEFAULT_GOAL := help
.PHONY: help setup build demo test test-peers bench bench-parts peers lint

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
	$(CARGO) test $(PEERS)
	@scripts/test-log-readers

bench: setup ## Run the benchmarks
	$(CARGO) bench --workspace

bench-parts: build ## Time the parts of a tick, kinematics beside Pinocchio's (which is fetched from PyPI, once)
	@scripts/setup-pinocchio
	MIKOSHI_PINOCCHIO="$(abspath $(TARGET))/pinocchio" $(CARGO) bench --workspace --bench parts

test-peers: ## Test the other transports, too, that frames are compared over
	$(if $(DDS),,@echo "peers: CycloneDDS is left out, since cyclonedds-dev, cyclonedds-tools or pkg-config is missing")
	$(CARGO) test $(PEERS) $(ALL_PEERS)

peers: ## Compare the exchange of frames with raw memory, iceoryx2, sockets, Zenoh, CycloneDDS
	$(if $(DDS),,@echo "peers: CycloneDDS is left out, since cyclonedds-dev, cyclonedds-tools or pkg-config is missing")
	$(CARGO) run $(PEERS) $(ALL_PEERS) -- compare --json $(TARGET)/peers.json

lint: setup ## Formatting, clippy, and dependency rules where cargo-deny is installed
	$(CARGO) fmt --all --check
	$(CARGO) clippy --release --workspace --all-targets -- -D warnings
	$(CARGO) fmt --manifest-path bench/peers/Cargo.toml --check
	$(CARGO) clippy $(PEERS) --all-targets -- -D warnings
	@if $(CARGO) deny --version >/dev/null 2>&1; then $(CARGO) deny --all-features check; \
	else echo "lint: cargo-deny is not installed, dependency rules are not checked"; fi
