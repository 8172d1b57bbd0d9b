//! Computes the identity of a build: two programs with the same one agree about shared memory.

use std::{env, fs, path::Path};

/// The sources that define what lies in shared memory.
const SOURCES: [&str; 2] = ["src", "../bus/src"];

fn main() {
    let mut hash = FNV_OFFSET;
    for folder in SOURCES {
        println!("cargo::rerun-if-changed={folder}");
        add(Path::new(folder), &mut hash);
    }
    let version = env::var("CARGO_PKG_VERSION").expect("Cargo sets it");
    for byte in version.bytes() {
        step(&mut hash, byte);
    }
    println!("cargo::rustc-env=OMNIBUS_BUILD={hash}");
    println!("cargo::rustc-env=OMNIBUS_VERSION={version} (build {hash:016x})");
}

fn add(path: &Path, hash: &mut u64) {
    if path.is_dir() {
        let entries = fs::read_dir(path).expect("a folder of sources");
        let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
        paths.sort();
        paths.iter().for_each(|path| add(path, hash));
        return;
    }
    let bytes = fs::read(path).expect("a source file");
    path.to_string_lossy().bytes().chain(bytes).for_each(|byte| step(hash, byte));
}

/// FNV-1a, 64 bits: http://www.isthe.com/chongo/tech/comp/fnv/
const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;

fn step(hash: &mut u64, byte: u8) {
    *hash = (*hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
}
