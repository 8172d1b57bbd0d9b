//! Makes a doctest of every Rust block in the README and in `docs/`, and a list of the shell blocks.
//!
//! A block that has no `fn main` may rely on values that the comment above it names:
//! `<!-- given: client: &mut Client, car: ActorId -->`. They become parameters, the items of
//! `client_lib` are imported, and `?` works. Nothing of it is run: a simulator would be needed.

use std::{
    env,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

fn main() {
    let root = Path::new(&env::var("CARGO_MANIFEST_DIR").unwrap()).join("..");
    let mut text = String::new();
    for file in pages(&root) {
        println!("cargo::rerun-if-changed={}", file.display());
        let name = file.strip_prefix(&root).unwrap().display().to_string();
        let page = fs::read_to_string(&file).unwrap();
        for (line, given, block) in rust_blocks(&page) {
            let module: String =
                name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
            writeln!(text, "/// {name}, line {line}.\n///\n/// ```no_run").unwrap();
            for line in doctest(&block, &given).lines() {
                writeln!(text, "/// {line}").unwrap();
            }
            writeln!(text, "/// ```\npub mod {}_line_{line} {{}}", module.to_lowercase()).unwrap();
        }
    }
    let out = PathBuf::from(env::var("OUT_DIR").unwrap()).join("docs.rs");
    fs::write(out, text).unwrap();
    println!("cargo::rerun-if-changed={}", root.join("docs").display());
    println!("cargo::rerun-if-changed=build.rs");
}

/// Returns the README and every page of the documentation, in order.
fn pages(root: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let mut pages: Vec<_> = entries.filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    pages.extend(["README.md", "client-lib/README.md"].map(|name| root.join(name)));
    pages.sort();
    pages
}

/// Returns each Rust block: its line, the values that it is given, and its text.
fn rust_blocks(page: &str) -> Vec<(usize, String, String)> {
    let mut blocks = Vec::new();
    let mut given = String::new();
    let mut lines = page.lines().enumerate();
    while let Some((i, line)) = lines.next() {
        if let Some(rest) = line.strip_prefix("<!-- given:") {
            given = rest.trim_end_matches("-->").trim().to_owned();
        } else if line == "```rust" {
            let block = lines.by_ref().map(|(_, line)| line).take_while(|line| *line != "```");
            blocks.push((i + 1, given.clone(), block.collect::<Vec<_>>().join("\n")));
            given.clear();
        } else if !line.is_empty() {
            given.clear();
        }
    }
    blocks
}

fn doctest(block: &str, given: &str) -> String {
    // Pages name the package as users do; this package renames it.
    let block = &block.replace("omnibus_client_lib", "client_lib");
    if block.contains("fn main") {
        return block.clone();
    }
    format!(
        "#[allow(unused, reason = \"a fragment\")]\n\
         use client_lib::*;\n\
         fn example({given}) -> Result<(), Box<dyn std::error::Error>> {{\n\
         {{\n{block}\n}}\n\
         Ok(())\n}}\n\
         fn main() {{}}"
    )
}
