//! Hashes the sources of the code that bakes, so that a baked item of another build is not found.
//!
//! The sources are those of this crate and of every crate of the workspace that it depends on.

use std::{
    collections::BTreeSet,
    env, fs, io,
    path::{Path, PathBuf},
};

fn main() -> io::Result<()> {
    let mut crates = BTreeSet::new();
    add_crate("bake", &mut crates)?;
    let sources = crates.iter().map(|name| Path::new("..").join(name).join("src"));
    let mut hash = 0xcbf2_9ce4_8422_2325;
    for source in sources.chain([PathBuf::from("../../Cargo.lock")]) {
        println!("cargo::rerun-if-changed={}", source.display());
        hash_tree(&source, &mut hash)?;
    }
    for name in &crates {
        println!("cargo::rerun-if-changed=../{name}/Cargo.toml");
    }
    hash_bytes(env::var("TARGET").unwrap_or_default().as_bytes(), &mut hash);
    println!("cargo::rustc-env=OMNIBUS_SOURCES={hash:016x}");
    println!("cargo::rustc-env=OMNIBUS_SOURCE_CRATES={}", Vec::from_iter(crates).join(" "));
    Ok(())
}

/// Adds the crate in the folder `name` beside this one, and the crates that it depends on.
fn add_crate(name: &str, crates: &mut BTreeSet<String>) -> io::Result<()> {
    if !crates.insert(name.to_owned()) {
        return Ok(());
    }
    let manifest = fs::read_to_string(Path::new("..").join(name).join("Cargo.toml"))?;
    let dependencies = manifest.split_once("\n[dependencies]\n").map_or("", |(_, rest)| rest);
    let lines = dependencies.lines().take_while(|line| !line.starts_with('['));
    for dependency in lines.filter_map(|line| line.split_once('.').map(|(name, _)| name.trim())) {
        if Path::new("..").join(dependency).join("Cargo.toml").exists() {
            add_crate(dependency, crates)?;
        }
    }
    Ok(())
}

fn hash_tree(path: &Path, hash: &mut u64) -> io::Result<()> {
    if path.is_dir() {
        let mut entries =
            fs::read_dir(path)?.map(|e| Ok(e?.path())).collect::<io::Result<Vec<_>>>()?;
        entries.sort();
        entries.iter().try_for_each(|entry| hash_tree(entry, hash))
    } else {
        hash_bytes(path.to_string_lossy().as_bytes(), hash);
        hash_bytes(&fs::read(path)?, hash);
        Ok(())
    }
}

/// FNV-1a.
fn hash_bytes(bytes: &[u8], hash: &mut u64) {
    for byte in bytes.iter().chain(&[0xff]) {
        *hash = (*hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    }
}
