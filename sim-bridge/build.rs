//! Lets binaries find MuJoCo's library at run time without LD_LIBRARY_PATH. Every package whose
//! binaries, tests or benchmarks link to the simulator names this file as its build script.

use std::env;
use std::path::Path;

const VARIABLE: &str = "MUJOCO_DYNAMIC_LINK_DIR";

fn main() {
    println!("cargo::rerun-if-env-changed={VARIABLE}");
    let Ok(directory) = env::var(VARIABLE) else {
        // Then mujoco-rs finds the library by itself or says why it cannot.
        return;
    };
    let library = Path::new(&directory).join("libmujoco.so");
    println!("cargo::rerun-if-changed={}", library.display());
    if !library.exists() {
        println!(
            "cargo::error=MuJoCo's library is not at {}: run `make setup`, or set {VARIABLE} to your copy",
            library.display()
        );
        return;
    }
    // Where it is installed comes first: an installed program forgets the others.
    println!("cargo::rustc-link-arg=-Wl,-rpath,$ORIGIN/../lib/mikoshi");
    println!("cargo::rustc-link-arg=-Wl,-rpath,{directory}");
    // For a checkout that was moved after it was built, seen from target/release.
    println!("cargo::rustc-link-arg=-Wl,-rpath,$ORIGIN/../../.mujoco/run-make-setup");
}
