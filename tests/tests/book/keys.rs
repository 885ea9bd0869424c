//! `docs/keys.md` is what the schema's sources say. `MIKOSHI_UPDATE_GOLDENS=1` writes it anew.

use core::fmt::Write as _;
use mikoshi_tests::programs::workspace;
use std::env;
use std::fs;

const PAGE: &str = "docs/keys.md";
const HEAD: &str = "\
# Keys

Every key of scenarios, teams, sweeps and robots, as the schema's sources say. This page is written by a test
(`MIKOSHI_UPDATE_GOLDENS=1 cargo test --release --workspace --test book`) and checked by it. A key ends in its unit. A key
whose type begins with `Option` may be left out; what the others are where they are left out stands in
`config/src`. `mikoshi plan` shows what a scenario comes to.
";

/// Parts of the schema: a title, and where its types are described.
const PARTS: [(&str, &[&str]); 3] = [
    (
        "Scenarios and teams",
        &[
            "scenario.rs",
            "grasp.rs",
            "coordination.rs",
            "job.rs",
            "membership.rs",
            "motion.rs",
            "operator.rs",
            "world.rs",
            "hosts.rs",
        ],
    ),
    ("Robots", &["robot.rs"]),
    ("Sweeps", &["survey.rs", "sweep.rs", "sweep/grid.rs", "sweep/range.rs", "sweep/comparison.rs"]),
];

/// What a key holds and means.
struct Key {
    name: String,
    kind: String,
    meaning: String,
}

/// A type that is read from a file.
struct Table {
    name: String,
    meaning: String,
    keys: Vec<Key>,
}

/// The types of a source file that can be read, in their order. They are written as rustfmt leaves them.
fn tables(source: &str) -> Vec<Table> {
    let mut tables: Vec<Table> = vec![];
    let (mut meaning, mut is_read, mut is_within) = (vec![], false, false);
    for line in source.lines() {
        let text = line.trim();
        if let Some(words) = text.strip_prefix("///") {
            meaning.push(words.trim().to_owned());
            continue;
        }
        if text.starts_with("#[") {
            is_read |= text.contains("Deserialize");
            continue;
        }
        if let Some(rest) = text.strip_prefix("pub struct ").filter(|_| is_read) {
            let name = rest.trim_end_matches(" {").to_owned();
            is_within = line.ends_with('{');
            tables.push(Table { name, meaning: meaning.join(" "), keys: vec![] });
        } else if let (true, Some((name, kind))) = (is_within, text.trim_end_matches(',').split_once(": "))
            && let (Some(table), Some(name)) = (tables.last_mut(), name.strip_prefix("pub "))
        {
            let meaning = meaning.join(" ");
            table.keys.push(Key { name: name.to_owned(), kind: kind.to_owned(), meaning });
        }
        is_within &= line != "}";
        is_read = false;
        meaning.clear();
    }
    tables
}

fn page() -> String {
    let mut page = HEAD.to_owned();
    for (title, files) in PARTS {
        // Writing to a String can't fail.
        let _ = write!(page, "\n## {title}\n");
        for file in files {
            let path = workspace().join("config/src").join(file);
            let source =
                fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            for Table { name, meaning, keys } in tables(&source).iter().filter(|table| !table.keys.is_empty())
            {
                let _ =
                    write!(page, "\n### {name}\n\n{meaning}\n\n| key | type | meaning |\n|---|---|---|\n");
                for Key { name, kind, meaning } in keys {
                    let meaning = meaning.replace('|', "\\|");
                    let _ = writeln!(page, "| `{name}` | `{kind}` | {meaning} |");
                }
            }
        }
    }
    page
}

#[test]
fn the_page_of_keys_is_what_the_schema_says() {
    let path = workspace().join(PAGE);
    if env::var_os("MIKOSHI_UPDATE_GOLDENS").is_some() {
        fs::write(&path, page()).expect("the book can be written");
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(found == page(), "{PAGE} is not what the schema says: MIKOSHI_UPDATE_GOLDENS=1 writes it anew");
}

#[test]
fn keys_are_found_with_their_types_and_meanings() {
    let source = "/// A box.\n#[derive(Deserialize)]\npub struct Box {\n    /// How\n    /// heavy.\n    \
                  #[serde(default)]\n    pub mass_kg: f64,\n}\n\n/// No file has it.\npub struct Other {\n    \
                  /// It.\n    pub it: u8,\n}\n";
    let [table] = &tables(source)[..] else { panic!("one type is read") };
    assert_eq!((table.name.as_str(), table.meaning.as_str()), ("Box", "A box."));
    let [key] = &table.keys[..] else { panic!("it has one key") };
    assert_eq!(
        (key.name.as_str(), key.kind.as_str(), key.meaning.as_str()),
        ("mass_kg", "f64", "How heavy.")
    );
}
