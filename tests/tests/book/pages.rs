//! Pages, and what is fenced in them.

use mikoshi_tests::programs::workspace;
use std::fs;
use std::path::PathBuf;

/// A page of the book, or the README.
pub struct Page {
    /// Its path in the repository.
    pub path: PathBuf,
    pub text: String,
}

/// What stands between two fences.
pub struct Block {
    /// What stands behind the first fence.
    pub kind: String,
    pub text: String,
    /// The last line above it that is not blank.
    pub above: String,
    /// Of its first line.
    pub line: usize,
}

impl Page {
    pub fn read(path: &str) -> Self {
        let text = fs::read_to_string(workspace().join(path));
        let text = text.unwrap_or_else(|error| panic!("{path}: {error}"));
        Self { path: path.into(), text }
    }

    /// The README, and all pages that the summary names.
    pub fn all() -> Vec<Self> {
        let summary = Self::read("docs/SUMMARY.md");
        let of_book = links(&summary.text).map(|link| Self::read(&format!("docs/{link}")));
        [Self::read("README.md")].into_iter().chain(of_book).collect()
    }

    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = vec![];
        let (mut is_open, mut above) = (false, String::new());
        for (index, line) in self.text.lines().enumerate() {
            match line.strip_prefix("```") {
                Some(kind) if !is_open => {
                    let kind = kind.trim().to_owned();
                    blocks.push(Block { kind, text: String::new(), above: above.clone(), line: index + 2 });
                    is_open = true;
                }
                Some(_) => is_open = false,
                None if is_open => {
                    if let Some(block) = blocks.last_mut() {
                        block.text += line;
                        block.text.push('\n');
                    }
                }
                None => {}
            }
            if !line.trim().is_empty() {
                line.clone_into(&mut above);
            }
        }
        assert!(!is_open, "{}: a fence is not closed", self.path.display());
        blocks
    }
}

/// Where a page's links lead.
pub fn links(text: &str) -> impl Iterator<Item = &str> {
    text.match_indices("](").filter_map(|(at, _)| text[at + 2..].split_once(')')).map(|(link, _)| link)
}
