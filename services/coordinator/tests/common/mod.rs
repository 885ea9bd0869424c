//! What tests of the coordinator have in common.

use mikoshi_config::{RunSpec, load_scenario};
use std::path::Path;

/// A scenario of the project with these values in place of its own.
pub fn resolved(scenario: &str, overrides: &[(&str, &str)]) -> RunSpec {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../config/scenarios")
        .join(scenario)
        .with_extension("toml");
    let overrides: Vec<_> =
        overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    mikoshi_resolution::resolve(&load_scenario(&path, &overrides, None).expect("it loads"))
        .expect("it resolves")
}
