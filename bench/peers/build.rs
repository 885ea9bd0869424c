//! With the feature `dds`, compiles what speaks to CycloneDDS in C.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    #[cfg(feature = "dds")]
    dds();
}

#[cfg(feature = "dds")]
fn dds() {
    use std::process::Command;

    const IDL: &str = "src/drivers/frames.idl";
    const SHIM: &str = "src/drivers/dds.c";
    println!("cargo:rerun-if-changed={IDL}");
    println!("cargo:rerun-if-changed={SHIM}");
    let out = std::env::var("OUT_DIR").expect("cargo says where");
    let compiled = Command::new("idlc").args(["-o", &out, IDL]).status();
    assert!(
        compiled.is_ok_and(|status| status.success()),
        "idlc of CycloneDDS is missing or failed: Debian has it in cyclonedds-tools, the headers in cyclonedds-dev"
    );
    cc::Build::new()
        .file(SHIM)
        .file(format!("{out}/frames.c"))
        .include(&out)
        .warnings(true)
        .compile("peers_dds");
    println!("cargo:rustc-link-lib=ddsc");
}
