//! Every function and every test that the table of equations names is there.

use crate::pages::Page;
use mikoshi_tests::programs::workspace;
use std::fs;

/// A path and a function in it, as a table's cell has them.
fn named(cell: &str) -> Option<(&str, &str)> {
    let mut parts = cell.split('`').skip(1).step_by(2);
    Some((parts.next()?, parts.next()?))
}

fn is_there((path, function): (&str, &str)) -> bool {
    let text = fs::read_to_string(workspace().join(path)).unwrap_or_default();
    ["(", "<"].iter().any(|bracket| text.contains(&format!("fn {function}{bracket}")))
}

#[test]
fn every_equation_has_its_function_and_its_test() {
    let page = Page::read("docs/equations.md");
    let rows: Vec<_> =
        page.text.lines().filter(|line| line.starts_with("| ") && line.contains("`crates/")).collect();
    assert!(rows.len() > 30, "{}", rows.len());
    for row in rows {
        let cells: Vec<_> = row.split('|').filter_map(named).collect();
        let [function, test] = cells[..] else { panic!("a function and a test are expected: {row}") };
        assert!(is_there(function), "{function:?} is not there: {row}");
        assert!(is_there(test), "{test:?} is not there: {row}");
    }
}

#[test]
fn what_is_not_there_is_found() {
    assert!(is_there(("crates/spatial/src/rotation.rs", "skew")));
    assert!(!is_there(("crates/spatial/src/rotation.rs", "ske")));
    assert!(!is_there(("crates/spatial/src/nothing.rs", "skew")));
}
