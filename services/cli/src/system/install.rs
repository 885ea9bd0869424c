//! `mikoshi install` and `mikoshi uninstall`: programs, units, user, configuration. A package is what an installation
//! into a folder leaves there.

use super::files::{
    COMPLETIONS, CONFIGURATION, CONFIGURED, GENERATOR, LIBRARIES, MANUAL, STATE, SYSTEM, TARGET, TextFile,
    USER, next_steps,
};
use super::programs::{LIBRARY, PROGRAMS, PROGRAMS_BUILT_APART, find_library, forget_build_folder};
use crate::arguments::{InstallArguments, ManArguments, UninstallArguments};
use crate::binaries;
use crate::commands::shell::{completion_script, man};
use crate::failure::{Failure, as_lines};
use crate::print::{print_error, print_out};
use std::fs;
use std::io::{ErrorKind, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Where an installation is.
struct Place {
    /// In front of every path: `/`, or where a package is made.
    root: PathBuf,
    /// Where programs and units go, as they will be seen.
    prefix: String,
}

impl Place {
    fn of(root: &Path, prefix: &Path) -> Result<Self, Failure> {
        match prefix
            .to_str()
            .filter(|prefix| prefix.starts_with('/') && !prefix.contains(char::is_whitespace))
        {
            Some(prefix) => {
                Ok(Self { root: root.to_owned(), prefix: prefix.trim_end_matches('/').to_owned() })
            }
            None => Err(Failure::usage(format!(
                "--prefix: found {}, expected an absolute path",
                prefix.display()
            ))),
        }
    }

    fn at(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    fn below_prefix(&self, path: &str) -> PathBuf {
        self.at(&format!("{}/{path}", self.prefix))
    }

    fn configured(&self, file: &TextFile) -> PathBuf {
        self.at(&format!("{CONFIGURATION}/{}", file.path))
    }

    /// All that is installed below the prefix.
    fn files(&self) -> impl Iterator<Item = PathBuf> {
        let programs = PROGRAMS.iter().chain(&PROGRAMS_BUILT_APART).map(|name| format!("bin/{name}"));
        let library = format!("{LIBRARIES}/{LIBRARY}");
        let texts = SYSTEM.iter().chain([&GENERATOR]).map(|file| file.path.to_owned());
        let completions = COMPLETIONS.iter().map(|(_, path)| (*path).to_owned());
        let all = programs.chain([library]).chain(texts).chain(completions);
        all.map(|path| self.below_prefix(&path)).chain(self.manual())
    }

    /// The manual pages that there are.
    fn manual(&self) -> Vec<PathBuf> {
        let pages = fs::read_dir(self.below_prefix(MANUAL)).into_iter().flatten().flatten();
        let ours = pages.filter(|page| page.file_name().to_string_lossy().starts_with("mikoshi"));
        ours.map(|page| page.path()).collect()
    }

    /// Whether it is this machine, and not a folder.
    fn is_here(&self) -> bool {
        self.root == Path::new("/")
    }
}

/// Puts everything where systemd finds it. Configuration that is there stays as it is.
///
/// # Errors
/// A program is missing, or a file can't be written.
pub fn install(arguments: &InstallArguments) -> Result<(), Failure> {
    let place = Place::of(&arguments.root, &arguments.prefix)?;
    let built_apart = PROGRAMS_BUILT_APART.iter().filter(|name| binaries::find(name).is_ok());
    for name in PROGRAMS.iter().chain(built_apart) {
        let mut program = read(&binaries::find(name)?)?;
        forget_build_folder(&mut program).map_err(|failure| failure.context(name))?;
        write(&place.below_prefix(&format!("bin/{name}")), &program, 0o755)?;
    }
    let library = read(&find_library()?)?;
    write(&place.below_prefix(&format!("{LIBRARIES}/{LIBRARY}")), &library, 0o644)?;
    for file in SYSTEM.iter().chain([&GENERATOR]) {
        let mode = if file.is_executable { 0o755 } else { 0o644 };
        write(&place.below_prefix(file.path), file.text(&place.prefix).as_bytes(), mode)?;
    }
    for (shell, path) in &COMPLETIONS {
        write(&place.below_prefix(path), &completion_script(*shell), 0o644)?;
    }
    man(&ManArguments { folder: place.below_prefix(MANUAL) })?;
    for file in &CONFIGURED {
        let path = place.configured(file);
        if !path.exists() {
            write(&path, file.text(&place.prefix).as_bytes(), 0o644)?;
        }
    }
    if place.is_here() {
        let below = |path: &str| place.below_prefix(path).display().to_string();
        tell_system("systemd-sysusers", &[&below("lib/sysusers.d/mikoshi.conf")]);
        tell_system("systemd-tmpfiles", &["--create", &below("lib/tmpfiles.d/mikoshi.conf")]);
        tell_system("systemctl", &["daemon-reload"]);
        print_out(&next_steps(&place.prefix));
    }
    Ok(())
}

/// Stops the team and its services, and takes away what was installed; with `--purge` configuration, results and
/// the user, too.
///
/// # Errors
/// A file can't be removed.
pub fn uninstall(arguments: &UninstallArguments) -> Result<(), Failure> {
    let place = Place::of(&arguments.root, &arguments.prefix)?;
    if place.is_here() {
        tell_system("systemctl", &["disable", TARGET]);
        // The second is the last to stop.
        tell_system("systemctl", &["stop", TARGET, "mikoshi-run.service"]);
    }
    for path in place.files() {
        remove_with_folders(&path, &place.at(&place.prefix))?;
    }
    if arguments.purge {
        for folder in [CONFIGURATION, STATE] {
            remove_all(&place.at(folder))?;
        }
    }
    if place.is_here() {
        tell_system("systemctl", &["daemon-reload"]);
        if arguments.purge {
            tell_system("userdel", &[USER]);
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|error| Failure::fault(error).context(path.display()))
}

/// Under its name once it is complete, so that a program that runs is not written to.
fn write(path: &Path, bytes: &[u8], mode: u32) -> Result<(), Failure> {
    let unfinished = path.with_extension("unfinished");
    let written = || {
        path.parent().map_or(Ok(()), fs::create_dir_all)?;
        let _ = fs::remove_file(&unfinished);
        let mut options = fs::OpenOptions::new();
        options.write(true).create_new(true).mode(mode).open(&unfinished)?.write_all(bytes)?;
        fs::rename(&unfinished, path)
    };
    written().map_err(|error| Failure::fault(error).context(path.display()))
}

/// Removes a file, and the folders above it that are empty then, but for `bin`, `lib` and the like in the prefix.
fn remove_with_folders(path: &Path, prefix: &Path) -> Result<(), Failure> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            return Err(Failure::fault(error).context(path.display()));
        }
        _ => {}
    }
    let folders = path.ancestors().skip(1).take_while(|folder| folder.parent() != Some(prefix));
    // One that holds something else stays, and those above it.
    let _ = folders.map(fs::remove_dir).take_while(Result::is_ok).count();
    Ok(())
}

fn remove_all(folder: &Path) -> Result<(), Failure> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(Failure::fault(error).context(folder.display()))
        }
        _ => Ok(()),
    }
}

/// Runs a program of the system. Where there is none, or it fails, people must do what it would have done.
fn tell_system(program: &str, arguments: &[&str]) {
    let told = Command::new(program).args(arguments).stdin(Stdio::null()).output();
    let problem = match told {
        Ok(output) if output.status.success() => return,
        Ok(output) => format!("{}\n{}", output.status, String::from_utf8_lossy(&output.stderr).trim()),
        Err(error) => error.to_string(),
    };
    print_error(&as_lines("warning", &format!("{program} {}: {problem}", arguments.join(" "))));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_that_were_made_for_a_file_go_with_it_and_others_stay() {
        let root = tempfile::tempdir().expect("a folder");
        let [one, other] = ["lib/a/b/one", "lib/other"].map(|path| root.path().join(path));
        for path in [&one, &other] {
            write(path, b"text", 0o644).expect("it can be written");
        }
        remove_with_folders(&one, root.path()).expect("it can be removed");
        assert!(!root.path().join("lib/a").exists() && other.exists());
        remove_with_folders(&other, root.path()).expect("it can be removed");
        assert!(!other.exists() && root.path().join("lib").exists());
        remove_with_folders(&other, root.path()).expect("there is none");
    }

    #[test]
    fn a_prefix_is_absolute_and_one_word() {
        for wrong in ["usr", "/opt/my programs"] {
            assert!(Place::of(Path::new("/"), Path::new(wrong)).is_err());
        }
        let place = Place::of(Path::new("/tmp/x"), Path::new("/usr/")).expect("a prefix");
        assert_eq!(place.below_prefix("bin/a"), Path::new("/tmp/x/usr/bin/a"));
    }

    #[test]
    fn every_text_names_its_prefix_and_no_other() {
        for file in SYSTEM.iter().chain([&GENERATOR]) {
            let text = file.text("/opt/x");
            let names_another = text.contains("/usr/") && !file.path.starts_with("share/doc/");
            assert!(!text.contains("@PREFIX@") && !names_another, "{}", file.path);
        }
    }
}
