//! docs/opendrive-coverage.md against the reader's source.

use std::collections::BTreeMap;

const PAGE: &str = include_str!("../../../../docs/opendrive-coverage.md");

/// The source files of the reader.
const SOURCES: [&str; 9] = [
    include_str!("../parse.rs"),
    include_str!("../parse/elements.rs"),
    include_str!("../parse/junctions.rs"),
    include_str!("../parse/lanes.rs"),
    include_str!("../parse/objects.rs"),
    include_str!("../parse/roads.rs"),
    include_str!("../parse/roadrunner.rs"),
    include_str!("../parse/signals.rs"),
    include_str!("../xml.rs"),
];

/// Returns the page's elements by their path, and what it says about each.
fn page() -> BTreeMap<String, String> {
    let mut path: Vec<&str> = Vec::new();
    let mut found = BTreeMap::new();
    for line in PAGE.lines() {
        let Some((indent, item)) = line.split_once("- `") else { continue };
        let (name, said) = item.split_once("` ").expect("an element and a word");
        path.truncate(indent.len() / 2);
        path.push(name);
        let word = said.split(';').next().unwrap_or_default().trim();
        assert!(matches!(word, "yes" | "stored" | "no"), "{line}");
        let new = found.insert(path.join("/"), word.to_string()).is_none();
        assert!(new, "{} stands twice", path.join("/"));
    }
    found
}

/// Returns whether a source compares an element's name with `name`.
fn is_read(name: &str) -> bool {
    let quoted = format!("\"{name}\"");
    SOURCES.iter().any(|source| {
        source.lines().filter(|line| line.contains(&quoted)).any(|line| {
            let asks_attribute =
                ["raw(", "string(", "number", "integer(", "required("].iter().any(|call| {
                    line.contains(&format!("{call}{quoted}"))
                        || line.contains(&format!("{call}_or({quoted}"))
                });
            !asks_attribute || line.contains(&format!("{quoted} =>"))
        })
    })
}

#[test]
fn the_page_describes_every_element_as_the_reader_treats_it() {
    let page = page();
    assert!(page.len() > 90);
    let name = |path: &str| path.rsplit('/').next().unwrap_or_default().to_string();
    let is_reported = |word: &str| word != "no";
    for (path, word) in page.iter().filter(|(_, word)| is_reported(word)) {
        assert!(is_read(&name(path)), "{path} is said to be {word}, but nothing reads it");
    }
    for (path, _) in page.iter().filter(|(_, word)| !is_reported(word)) {
        // Some names occur in several places, of which some are read.
        let elsewhere = page.iter().any(|(p, word)| is_reported(word) && name(p) == name(path));
        assert!(elsewhere || !is_read(&name(path)), "{path} is said not to be read, but it is");
    }
}

#[test]
fn every_element_of_the_reader_is_on_the_page() {
    let page = page();
    let known: Vec<&str> = page.keys().filter_map(|path| path.rsplit('/').next()).collect();
    for source in SOURCES {
        for line in source.lines().filter(|line| line.contains("\" =>") && !line.contains("Some("))
        {
            let names = line.split("=>").next().unwrap_or_default().split('"').skip(1).step_by(2);
            for name in names.filter(|name| !UNITS.contains(name)) {
                assert!(known.contains(&name), "{name} is read, but not on the page");
            }
        }
    }
}

/// Matched words that are not elements.
const UNITS: [&str; 2] = ["km/h", "mph"];
