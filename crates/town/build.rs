//! Names the code that bakes, so that nothing baked by other code is taken for its work.

use std::{env, fs, io, path::Path};

/// Whatever decides what a town looks like, from this folder.
const SOURCES: [&str; 4] = ["src", "../road/src", "../mesh/src", "../../Cargo.lock"];

fn main() -> io::Result<()> {
    let mut hash = 0xcbf2_9ce4_8422_2325;
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        take(Path::new(source), &mut hash)?;
    }
    take_bytes(env::var("TARGET").unwrap_or_default().as_bytes(), &mut hash);
    println!("cargo::rustc-env=OMNIBUS_SOURCES={hash:016x}");
    Ok(())
}

fn take(path: &Path, hash: &mut u64) -> io::Result<()> {
    if !path.exists() {
        return Ok(());
    }
    if path.is_dir() {
        let mut entries =
            fs::read_dir(path)?.map(|e| Ok(e?.path())).collect::<io::Result<Vec<_>>>()?;
        entries.sort();
        entries.iter().try_for_each(|entry| take(entry, hash))
    } else {
        take_bytes(path.to_string_lossy().as_bytes(), hash);
        take_bytes(&fs::read(path)?, hash);
        Ok(())
    }
}

/// FNV-1a.
fn take_bytes(bytes: &[u8], hash: &mut u64) {
    for byte in bytes.iter().chain(&[0xff]) {
        *hash = (*hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    }
}
