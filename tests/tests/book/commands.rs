//! Commands of a page are carried out in their order, in a folder that holds what a clone holds for them.
//!
//! A block of `sh` is run; one of `sh,no-run` is not, and a comment above it says why: `<!-- not run: … -->`. Every
//! line of a block of `text,printed` must be printed by the block before it; `…` stands for anything. What is said
//! `on-machines` of their own is carried out by `make test-systemd`, of one page.

use crate::pages::{Block, Page};
use mikoshi_tests::programs::{folder, workspace};
use rustix::process::{Pid, Signal, kill_process_group};
use std::env;
use std::os::unix::fs::symlink;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// The page whose blocks are carried out on machines (`scripts/test-cluster`).
const ON_MACHINES: &str = "docs/cluster.md";

/// What a user has who has cloned and built the project.
fn clone() -> TempDir {
    let clone = tempfile::tempdir().expect("a folder");
    let copied = Command::new("cp").arg("-r").arg(workspace().join("config")).arg(clone.path()).status();
    assert!(copied.expect("cp runs").success());
    let release = clone.path().join("target/release");
    std::fs::create_dir_all(release.parent().expect("a folder")).expect("a folder");
    symlink(folder(), release).expect("a link");
    clone
}

/// Runs a block to its end, and nothing that it started goes on; what it printed, and whether all went well.
fn run(block: &Block, clone: &Path) -> (String, bool) {
    let paths = env::var_os("PATH").unwrap_or_default();
    let path = [folder().to_owned()].into_iter().chain(env::split_paths(&paths));
    let child = Command::new("sh")
        .args(["-e", "-c", &format!("exec 2>&1\n{}", block.text)])
        .current_dir(clone)
        .env("PATH", env::join_paths(path).expect("folders"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .process_group(0)
        .spawn()
        .expect("sh runs");
    let group = i32::try_from(child.id()).ok().and_then(Pid::from_raw).expect("a pid");
    let ended = child.wait_with_output().expect("it was started");
    // Mostly there is nobody left.
    let _ = kill_process_group(group, Signal::TERM);
    (String::from_utf8_lossy(&ended.stdout).into_owned(), ended.status.success())
}

fn is_printed(line: &str, printed: &str) -> bool {
    let mut parts = line.split('…');
    let first = parts.next().unwrap_or_default().trim_start();
    printed.lines().any(|found| {
        let Some(at) = found.find(first) else { return false };
        let mut rest = &found[at + first.len()..];
        parts.clone().all(|part| match rest.find(part) {
            Some(at) => {
                rest = &rest[at + part.len()..];
                true
            }
            None => false,
        })
    })
}

/// What goes wrong on a page.
fn failures_of(page: &Page) -> Vec<String> {
    let (clone, mut printed) = (clone(), String::new());
    let (mut failures, mut is_elsewhere) = (vec![], false);
    for block in page.blocks() {
        let place = format!("{}:{}", page.path.display(), block.line);
        match block.kind.as_str() {
            "sh" => {
                let (out, is_well) = run(&block, clone.path());
                if !is_well {
                    failures.push(format!("{place}: this failed:\n{}{out}", block.text));
                }
                printed = out;
            }
            "sh,no-run" if !block.above.starts_with("<!-- not run: ") => {
                failures.push(format!("{place}: nobody says why it is not run"));
            }
            kind if kind.contains("on-machines") => {
                // They print there.
                is_elsewhere = true;
                if page.path != Path::new(ON_MACHINES) {
                    failures.push(format!("{place}: nobody carries this out"));
                }
                continue;
            }
            "text,printed" if is_elsewhere => {}
            "text,printed" => {
                let missing = block.text.lines().filter(|line| !is_printed(line, &printed));
                failures
                    .extend(missing.map(|line| format!("{place}: {line:?} is not printed, but:\n{printed}")));
            }
            _ => {}
        }
        is_elsewhere &= block.kind == "text,printed";
    }
    failures
}

#[test]
fn every_command_of_the_book_and_the_readme_does_what_is_said() {
    let failures: Vec<_> = Page::all().iter().flat_map(failures_of).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_wrong_command_and_a_wrong_word_are_found() {
    let page = |text: &str| Page { path: "page".into(), text: text.to_owned() };
    let fenced = |kind: &str, text: &str| format!("```{kind}\n{text}\n```\n");
    let good = fenced("sh", "mikoshi --version") + &fenced("text,printed", "mikoshi 0.…");
    assert_eq!(failures_of(&page(&good)), Vec::<String>::new());
    for bad in [
        fenced("sh", "mikoshi runn"),
        fenced("sh", "mikoshi --version") + &fenced("text,printed", "mikoshi 7.…"),
        fenced("sh", "mikoshi --nonsense\ntrue"),
        fenced("sh,no-run", "make demo"),
        fenced("sh,on-machines", "# desk\nmake demo"),
    ] {
        assert_eq!(failures_of(&page(&bad)).len(), 1, "{bad}");
    }
}
