//! Links within the book lead somewhere.

use crate::pages::{Page, links};
use mikoshi_tests::programs::workspace;

#[test]
fn every_link_to_a_file_has_its_file() {
    for page in Page::all() {
        let folder = page.path.parent().expect("a page lies somewhere");
        for link in links(&page.text).filter(|link| !link.contains("://") && !link.starts_with('#')) {
            let file = link.split('#').next().unwrap_or_default();
            assert!(workspace().join(folder).join(file).exists(), "{}: {link}", page.path.display());
        }
    }
}

#[test]
fn every_page_of_the_book_is_in_its_summary() {
    let summary = Page::read("docs/SUMMARY.md");
    for entry in std::fs::read_dir(workspace().join("docs")).expect("the book").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_page = name.ends_with(".md") && name != "SUMMARY.md";
        assert!(!is_page || links(&summary.text).any(|link| link == name), "{name} is in no summary");
    }
}
