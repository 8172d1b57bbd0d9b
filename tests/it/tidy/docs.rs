//! The code blocks of the README and of `docs/`.
//!
//! Rust blocks are compiled as doctests of this package (`build.rs`, `src/lib.rs`).
//! Shell blocks are parsed by the programs that they name; Python blocks are compiled.

use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::kit::note_skipped;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Returns every page of the documentation.
pub(super) fn pages() -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let mut pages: Vec<_> = entries.filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    pages.sort();
    pages
}

/// A fenced block: the page and the line where it begins, and its text.
struct Block {
    place: String,
    text: String,
}

/// Returns the blocks of one language in all pages and READMEs.
fn blocks(language: &str) -> Vec<Block> {
    let mut files = pages();
    files.extend(super::folders().iter().map(|folder| folder.join("README.md")));
    files.extend(
        ["README.md", "CONTRIBUTING.md", "crates/carla08/README.md"].map(|f| root().join(f)),
    );
    let fence = format!("```{language}");
    let mut blocks = Vec::new();
    for file in files {
        let page = fs::read_to_string(&file).unwrap_or_default();
        let name = file.strip_prefix(root()).unwrap_or(&file).display().to_string();
        let mut lines = page.lines().enumerate();
        while let Some((i, line)) = lines.next() {
            if line == fence {
                let text = lines.by_ref().map(|(_, line)| line).take_while(|line| *line != "```");
                let text = text.collect::<Vec<_>>().join("\n");
                blocks.push(Block { place: format!("{name}:{}", i + 1), text });
            }
        }
    }
    blocks
}

/// Returns why a line of shell cannot run, or nothing.
fn shell_fault(line: &str) -> Option<String> {
    let line = line.split(" #").next().unwrap_or("").trim().trim_end_matches('&').trim();
    if line.is_empty() || line.starts_with('#') {
        return None;
    }
    let words: Vec<&str> =
        line.split_whitespace().map(|word| word.trim_matches(['"', '\''])).collect();
    let is_variable = |word: &str| {
        word.split_once('=')
            .is_some_and(|(name, _)| name.chars().all(|c| c.is_ascii_uppercase() || c == '_'))
    };
    // What follows `>` is a file, not an argument.
    let words = words.into_iter().skip_while(|word| is_variable(word));
    let words: Vec<&str> = words.take_while(|word| *word != ">").collect();
    let (program, args) = words.split_first()?;
    match *program {
        "omnibus" | "target/release/omnibus" => {
            omnibus::check_args([&["omnibus"], args].concat().into_iter().map(Into::into)).err()
        }
        "./run" => {
            let verb = args.first().copied().unwrap_or("");
            let script = fs::read_to_string(root().join("run")).unwrap();
            let is_known = script.lines().any(|line| line == format!("{verb})"));
            (!is_known).then(|| format!("./run has no command {verb:?}"))
        }
        "cargo" => cargo_fault(args),
        "python3" | "python" => {
            let file = args.iter().find(|arg| arg.ends_with(".py"))?;
            (!root().join(file).exists()).then(|| format!("{file} does not exist"))
        }
        "pip" | "git" | "cd" | "export" | "rustup" => None,
        _ => Some(format!("no check is known for {program:?}")),
    }
}

/// Packages, programs, examples and tests that a cargo command names have to exist.
fn cargo_fault(args: &[&str]) -> Option<String> {
    let packages = super::packages();
    let has_target = |kind: &str, name: &str| {
        packages.iter().flat_map(|package| package["targets"].as_array().unwrap()).any(|target| {
            target["name"] == name && target["kind"].as_array().unwrap().iter().any(|k| k == kind)
        })
    };
    for pair in args.windows(2).take_while(|pair| pair[0] != "--") {
        let is_known = match pair[0] {
            "-p" | "--package" => packages.iter().any(|package| package["name"] == pair[1]),
            "--example" => has_target("example", pair[1]),
            "--bin" => has_target("bin", pair[1]),
            "--test" => has_target("test", pair[1]),
            _ => true,
        };
        if !is_known {
            return Some(format!("{} {} does not exist", pair[0], pair[1]));
        }
    }
    None
}

#[test]
fn every_shell_command_of_the_documentation_is_accepted() {
    let mut faults = Vec::new();
    for block in blocks("sh") {
        for line in block.text.replace("\\\n", " ").lines() {
            faults.extend(
                shell_fault(line).map(|fault| format!("{}: {line}\n  {fault}", block.place)),
            );
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_shell_command_that_would_be_refused_is_found() {
    for line in [
        "omnibus collect --no-such-option",
        "omnibus inspekt",
        "./run tset",
        "cargo run -p omnibus-client-lib --example no_such_example",
        "cargo test -p no-such-package",
        "python3 no/such/file.py",
        "no-such-program",
    ] {
        assert!(shell_fault(line).is_some(), "{line}");
    }
    for line in [
        "OMNIBUS_MAPS=maps omnibus collect --frames 3 --out data # three",
        "./run test",
        "omnibus run &",
    ] {
        assert_eq!(shell_fault(line), None, "{line}");
    }
}

#[test]
fn every_python_block_of_the_documentation_compiles() {
    for block in blocks("python") {
        let python = Command::new("python3")
            .args([
                "-c",
                "import sys; compile(sys.stdin.read(), sys.argv[1], 'exec')",
                &block.place,
            ])
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let Ok(mut python) = python else {
            note_skipped("every_python_block_of_the_documentation_compiles", "no python3");
            return;
        };
        python.stdin.take().unwrap().write_all(block.text.as_bytes()).unwrap();
        let ended = python.wait_with_output().unwrap();
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    }
}

#[test]
fn limits_in_the_documentation_are_those_of_the_code() {
    let page = |name: &str| fs::read_to_string(root().join("docs").join(name)).unwrap();
    let wait = format!("has used no processor time for {} s; is it stopped?", bus::ADMISSION_SECS);
    assert!(page("errors.md").contains(&wait), "docs/errors.md lacks {wait:?}");
    let limit = format!("at most {} bytes", size_of::<protocol::Name>());
    assert!(page("sensors.md").contains(&limit), "docs/sensors.md lacks {limit:?}");
}

#[test]
fn the_index_names_every_page() {
    let index = fs::read_to_string(root().join("docs/README.md")).unwrap();
    for page in pages() {
        let name = page.file_name().unwrap().to_str().unwrap();
        assert!(
            name == "README.md" || index.contains(&format!("({name})")),
            "docs/README.md lacks {name}"
        );
    }
}

#[test]
fn every_link_to_a_file_leads_somewhere() {
    let mut files = pages();
    files.extend(super::folders().iter().map(|folder| folder.join("README.md")));
    for name in ["README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CHANGELOG.md"] {
        files.push(root().join(name));
    }
    let mut faults = Vec::new();
    for file in files {
        let text = fs::read_to_string(&file).unwrap_or_default();
        for rest in text.split("](").skip(1) {
            let target = rest.split([')', ' ']).next().unwrap_or("");
            let path = target.split('#').next().unwrap_or("");
            if !path.is_empty()
                && !target.contains("://")
                && !file.parent().unwrap().join(path).exists()
            {
                faults.push(format!("{}: {target}", file.display()));
            }
        }
    }
    assert!(faults.is_empty(), "links that lead nowhere:\n{}", faults.join("\n"));
}

#[test]
fn the_table_of_refusals_has_every_code_with_its_number_and_description() {
    let page = fs::read_to_string(root().join("docs/errors.md")).unwrap();
    for code in protocol::RefusalCode::ALL {
        let row = format!("| {} | `{}` | {} |", *code as u32, code.name(), code.description());
        assert!(page.lines().any(|line| line == row), "docs/errors.md lacks the row {row}");
    }
}
