# `make demo` and `make test` do all the set-up they need: a checkout, cargo, C and C++ compilers and python3
# suffice. One build profile serves everything, so a clean checkout compiles its dependencies once.

CARGO ?= cargo
TARGET := $(or $(CARGO_TARGET_DIR),target)
RELEASE := $(TARGET)/release
# Workspaces of their own, beside what has been built.
PEERS := --release --manifest-path bench/peers/Cargo.toml --target-dir $(TARGET)
RAPIER := --release --manifest-path sim-bridge/rapier/Cargo.toml --target-dir $(TARGET)
VIEW := --release --manifest-path services/view/Cargo.toml --target-dir $(TARGET)
LINK := --release --manifest-path services/link/Cargo.toml --target-dir $(TARGET)
COMMA := ,
DDS = $(shell pkg-config --exists CycloneDDS && command -v idlc)
ALL_PEERS = --features zenoh$(if $(DDS),$(COMMA)dds)
.DEFAULT_GOAL := help
.PHONY: help setup build demo three-kinds view watch second-engine link test test-peers test-view test-second-engine test-link test-systemd tables bench bench-parts peers lint package

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-18s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## Fetch MuJoCo's library (once) into .mujoco/run-make-setup
	@command -v $(CARGO) >/dev/null || { echo "make: cargo is missing: see https://rustup.rs" >&2; exit 1; }
	@command -v cc >/dev/null || { echo "make: a C compiler (cc) is missing" >&2; exit 1; }
	@command -v c++ >/dev/null || { echo "make: a C++ compiler (c++) is missing" >&2; exit 1; }
	@scripts/setup-mujoco

build: setup ## Build target/release/mikoshi and the services beside it
	$(CARGO) build --release --workspace --bins

demo: build ## Four robots walk and carry one object
	$(RELEASE)/mikoshi run config/scenarios/transport.toml

three-kinds: build ## Robots of three kinds carry one object (Talos' description is fetched from PyPI, once)
	@described=$$(scripts/setup-talos) && eval "$$described" && $(RELEASE)/mikoshi run config/scenarios/kinds/3.toml

view: build ## Build target/release/mikoshi-view, too, with which `mikoshi view` shows runs
	$(CARGO) build $(VIEW)

second-engine: build ## Build target/release/mikoshi-bridge-rapier, another world for `mikoshi run --bridge`
	$(CARGO) build $(RAPIER)

link: build ## Build target/release/mikoshi-link, too, which carries frames between the hosts of a team
	$(CARGO) build $(LINK) --bins

watch: view ## Four robots walk and carry one object, on a page in the browser
	$(RELEASE)/mikoshi run config/scenarios/transport.toml --real-time --viewer

test: build ## Run every test
	$(CARGO) test --release --workspace
	$(CARGO) test $(PEERS)
	@scripts/test-log-readers

bench: setup ## Run the benchmarks
	$(CARGO) bench --workspace

bench-parts: build ## Time the parts of a tick, kinematics beside Pinocchio's (which is fetched from PyPI, once)
	@scripts/setup-pinocchio
	MIKOSHI_PINOCCHIO="$(abspath $(TARGET))/pinocchio" $(CARGO) bench --workspace --bench parts

package: link ## Make the Debian package, target/package/mikoshi.deb
	@$(CARGO) deb --version >/dev/null 2>&1 || $(CARGO) install --quiet --locked cargo-deb@3.8.0
	rm -rf target/package
	$(RELEASE)/mikoshi install --root target/package/root --prefix /usr
	strip target/package/root/usr/bin/*
	$(CARGO) deb --quiet --fast --no-build --package mikoshi --output target/package/mikoshi.deb

test-systemd: package ## Test the package, and docs/cluster.md, on machines with systemd in namespaces (as root)
	@scripts/test-systemd target/package/mikoshi.deb
	@scripts/test-cluster target/package/mikoshi.deb

tables: link ## Print tables of docs/results.md: robots that lose their servo, carriers on bad ways, a flood (as root)
	SPEED=0.04 $(CARGO) test --release --workspace --test lost_servo -- --ignored --nocapture table
	$(CARGO) test $(LINK) --test cluster -- --ignored --nocapture --test-threads 1

test-peers: ## Test the other transports, too, that frames are compared over
	$(if $(DDS),,@echo "peers: CycloneDDS is left out, since cyclonedds-dev, cyclonedds-tools or pkg-config is missing")
	$(CARGO) test $(PEERS) $(ALL_PEERS)

test-view: build ## Test the viewer: needs chromium
	$(CARGO) test $(VIEW)

test-second-engine: build ## Test the second engine, and that teams carry in it
	$(CARGO) test $(RAPIER)

test-link: build ## Test the link, with namespaces as hosts (as root; else it says what it leaves out)
	$(CARGO) test $(LINK) -- --test-threads 1

peers: ## Compare the exchange of frames with raw memory, iceoryx2, sockets, Zenoh, CycloneDDS
	$(if $(DDS),,@echo "peers: CycloneDDS is left out, since cyclonedds-dev, cyclonedds-tools or pkg-config is missing")
	$(CARGO) run $(PEERS) $(ALL_PEERS) -- compare --json $(TARGET)/peers.json

lint: setup ## Formatting, clippy, and dependency rules where cargo-deny is installed
	$(CARGO) fmt --all --check
	$(CARGO) clippy --release --workspace --all-targets -- -D warnings
	$(CARGO) fmt --manifest-path bench/peers/Cargo.toml --check
	$(CARGO) fmt --manifest-path services/view/Cargo.toml --check
	$(CARGO) fmt --manifest-path sim-bridge/rapier/Cargo.toml --check

	$(CARGO) fmt --manifest-path services/link/Cargo.toml --check
	$(CARGO) clippy $(PEERS) --all-targets -- -D warnings
	@if $(CARGO) deny --version >/dev/null 2>&1; then $(CARGO) deny --all-features check && \
	$(CARGO) deny --manifest-path services/link/Cargo.toml --config deny.toml check; \
	else echo "lint: cargo-deny is not installed, dependency rules are not checked"; fi
