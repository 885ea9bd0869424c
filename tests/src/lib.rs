//! Closed-loop, determinism, fault and conformance tests across processes.
