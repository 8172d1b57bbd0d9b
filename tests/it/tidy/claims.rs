//! What the READMEs of the crates say that they never do, held against their source.
//!
//! Clippy holds some claims more exactly (`clippy.toml` of the crate); the manifests hold others
//! (`tidy.rs`). Here are those that are about names in the source.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use super::source::{files, is_name, is_test_file, named_paths, tokens, use_tree, without_tests};

/// Names that reach the disk.
const DISK: &[&str] = &[
    "std::fs",
    "fs::",
    "File::open",
    "File::create",
    "File::options",
    "OpenOptions",
    "memmap2",
    "tempfile",
];
/// Names that read a clock of the machine.
const CLOCK: &[&str] = &["Instant", "SystemTime"];
/// Names that read the environment of the process.
const ENVIRONMENT: &[&str] = &["std::env", "env::var", "env::var_os"];
/// Names that convert to and from degrees.
const DEGREES: &[&str] = &["to_degrees", "to_radians"];
/// Ports that only the host and clients open: with them the world can be changed.
const WORLD_WRITERS: &[&str] = &["HostPorts", "ClientPorts"];
/// CARLA's left-handed axes.
const LEFT_HAND: &[&str] = &["carla_axes"];

/// A crate's folder, the claim of its README, and the names that would break it.
const CLAIMS: &[(&str, &str, &[&str])] = &[
    ("crates/protocol", "never touches disk", DISK),
    ("crates/mesh", "never touches disk", DISK),
    ("crates/foxglove", "never touches disk", DISK),
    ("crates/road", "never touches disk", DISK),
    ("crates/town", "never touches disk", DISK),
    ("crates/mapgen", "never touches disk", DISK),
    ("traffic", "never touches disk", DISK),
    ("crates/protocol", "never reads a clock", CLOCK),
    ("crates/mesh", "never reads a clock", CLOCK),
    ("crates/foxglove", "never reads a clock", CLOCK),
    ("crates/road", "never reads a clock", CLOCK),
    ("crates/town", "never reads a clock", CLOCK),
    ("crates/mapgen", "never reads a clock", CLOCK),
    ("traffic", "never reads a clock", CLOCK),
    ("crates/road", "never reads the environment", ENVIRONMENT),
    ("crates/town", "never reads the environment", ENVIRONMENT),
    ("crates/mapgen", "never reads the environment", ENVIRONMENT),
    ("sensor-render", "has no way to change the world", WORLD_WRITERS),
    ("traffic", "changes the world by its own sample only", WORLD_WRITERS),
    ("crates/protocol", "radians only", DEGREES),
    ("crates/bus", "radians only", DEGREES),
    ("crates/mesh", "radians only", DEGREES),
    ("crates/town", "radians only", DEGREES),
    ("crates/mapgen", "radians only", DEGREES),
    ("crates/record", "radians only", DEGREES),
    ("sim-host", "radians only", DEGREES),
    ("traffic", "radians only", DEGREES),
    ("sensor-render", "radians only", DEGREES),
    ("sim-host", "right-handed", LEFT_HAND),
    ("traffic", "right-handed", LEFT_HAND),
    ("sensor-render", "right-handed", LEFT_HAND),
    ("crates/omnibus", "right-handed", LEFT_HAND),
];

/// CARLA's spherical projection has y to the south: only the GNSS receiver uses it.
const MERCATOR: [&str; 2] = ["crates/road", "sim-host/src/physics_sensors/gnss.rs"];

fn root() -> PathBuf {
    // Without `..`: a path through `tests` would make every file one of a test.
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// The paths that a file names outside of its tests.
fn paths_of(file: &Path) -> Vec<String> {
    let tokens = without_tests(&tokens(&fs::read_to_string(file).unwrap()));
    named_paths(&tokens).into_iter().map(|path| format!("{}::", path.join("::"))).collect()
}

/// Whether a path (`a::b::`) has the names of `forbidden` in a row.
fn has(path: &str, forbidden: &str) -> bool {
    let forbidden = format!("{}::", forbidden.trim_end_matches("::"));
    path.starts_with(&forbidden) || path.contains(&format!("::{forbidden}"))
}

#[test]
fn crates_do_not_do_what_their_readmes_say_they_never_do() {
    let mut faults = BTreeSet::new();
    for (folder, claim, forbidden) in CLAIMS {
        let src = root().join(folder).join("src");
        for file in files(&src).iter().filter(|file| !is_test_file(file)) {
            for path in paths_of(file) {
                if forbidden.iter().any(|name| has(&path, name)) {
                    let file = file.strip_prefix(root()).unwrap().display();
                    faults.insert(format!("{folder} {claim}, but {file} names {path}"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.into_iter().collect::<Vec<_>>().join("\n"));
}

#[test]
fn a_forbidden_name_is_found_in_paths_of_every_form() {
    for path in ["std::fs::", "std::fs::read::", "File::open::", "fs::read::"] {
        assert!(DISK.iter().any(|name| has(path, name)), "{path}");
    }
    for path in ["Profile::", "offs::x::", "std::fmt::"] {
        assert!(!DISK.iter().any(|name| has(path, name)), "{path}");
    }
}

#[test]
fn carla_s_projection_is_used_by_the_gnss_only() {
    for folder in ["crates", "sim-host", "traffic", "sensor-render", "client-lib"] {
        for file in files(&root().join(folder)).iter().filter(|file| !is_test_file(file)) {
            let name = file.strip_prefix(root()).unwrap().to_str().unwrap();
            let is_allowed = MERCATOR.iter().any(|allowed| name.starts_with(allowed));
            let is_used = paths_of(file).iter().any(|path| has(path, "CarlaMercator"));
            assert!(is_allowed || !is_used, "{name} uses CARLA's left-handed projection");
        }
    }
}

/// Returns what `pub` items say: signatures, fields, aliases, re-exports and whole enums.
fn public_tokens(tokens: &[String]) -> Vec<Vec<String>> {
    let mut items = Vec::new();
    for i in 0..tokens.len() {
        if tokens[i] != "pub" || tokens.get(i + 1).is_some_and(|t| t == "(") {
            continue;
        }
        let is_enum = tokens.get(i + 1).is_some_and(|t| t == "enum" || t == "trait");
        let mut depth = 0;
        let mut item = Vec::new();
        for token in &tokens[i..] {
            match token.as_str() {
                "{" if !is_enum && !item.iter().any(|t| t == "use") => break,
                ";" if depth == 0 => break,
                // The value of a constant is no part of what it promises.
                "=" if item.iter().any(|t| t == "const" || t == "static") => break,
                "," if depth == 0 && !is_enum => break,
                "{" | "(" | "<" | "[" => depth += 1,
                "}" | ")" | ">" | "]" => {
                    depth -= 1;
                    if depth <= 0 && token == "}" {
                        break;
                    }
                }
                _ => {}
            }
            item.push(token.clone());
        }
        items.push(item);
    }
    items
}

/// The faults of one file: public items that name a type of the transport.
fn exported(text: &str) -> Vec<String> {
    let tokens = without_tests(&tokens(text));
    let mut foreign = BTreeSet::from(["iceoryx2".to_owned()]);
    let mut i = 0;
    while i < tokens.len() {
        if tokens[i] == "use" {
            let len = tokens[i..].iter().position(|t| *t == ";").unwrap_or(1);
            for (path, name) in use_tree(&tokens[i + 1..i + len]) {
                if path[0].starts_with("iceoryx2") {
                    foreign.insert(name);
                }
            }
            i += len;
        }
        i += 1;
    }
    let items = public_tokens(&tokens).into_iter();
    let faults = items.filter(|item| item.iter().any(|t| is_name(t) && foreign.contains(t)));
    faults.map(|item| item.join(" ")).collect()
}

#[test]
fn the_bus_exports_no_type_of_its_transport() {
    let mut faults = Vec::new();
    for file in files(&root().join("crates/bus/src")) {
        for item in exported(&fs::read_to_string(&file).unwrap()) {
            faults.push(format!("{}: {item}", file.display()));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn an_exported_type_of_the_transport_is_found() {
    let used = "use iceoryx2::port::{publisher::Publisher, Other as Port};";
    for item in [
        "pub fn open() -> Publisher<u8> { f() }",
        "pub struct A { pub port: Port }",
        "pub enum E { A(Publisher) }",
        "pub type T = Port;",
        "pub use iceoryx2::prelude::Node;",
    ] {
        assert_eq!(exported(&format!("{used} {item}")).len(), 1, "{item}");
    }
    for item in [
        "pub fn open() -> u8 { Publisher::open() }",
        "pub struct A { port: Port, pub b: u8 }",
        "pub(crate) fn open() -> Publisher {}",
        "enum E { A(Publisher) }",
    ] {
        assert_eq!(exported(&format!("{used} {item}")), Vec::<String>::new(), "{item}");
    }
}

/// The five lines of a crate's README.
const README_LINES: [&str; 5] = ["Owns", "Reads", "Writes", "Never", "Start reading at"];

#[test]
fn every_crate_says_in_five_lines_what_it_is() {
    let mut faults = Vec::new();
    for folder in super::folders() {
        let readme = folder.join("README.md");
        let text = fs::read_to_string(&readme).unwrap_or_default();
        for line in README_LINES {
            let is_said =
                text.lines().any(|l| l.trim_start_matches(['-', ' ', '*']).starts_with(line));
            if !is_said {
                faults.push(format!("{} lacks the line \"{line}\"", readme.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_source_file_that_a_page_names_exists() {
    let mut pages: Vec<PathBuf> = super::folders().iter().map(|f| f.join("README.md")).collect();
    pages.extend(["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"].map(|name| root().join(name)));
    // The table of CARLA's own scripts names files of another repository.
    pages.extend(
        super::docs::pages().into_iter().filter(|page| !page.ends_with("carla-examples.md")),
    );
    let mut faults = Vec::new();
    for page in pages {
        let text = fs::read_to_string(&page).unwrap_or_default();
        for quoted in text.split('`').skip(1).step_by(2) {
            let is_source = [".rs", ".py", ".wgsl"].iter().any(|end| quoted.ends_with(end));
            let is_path = quoted.contains('/') && !quoted.contains([' ', '<', '*', '{']);
            let places = [root(), page.parent().unwrap().to_owned()];
            if is_source && is_path && !places.iter().any(|place| place.join(quoted).exists()) {
                faults.push(format!("{}: `{quoted}` does not exist", page.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
