//! Rust source as words and marks, without comments and strings.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// A word or a mark; `::` is one mark.
pub(crate) type Token = String;

/// Whether a token is a word.
pub(crate) fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Returns every Rust file below a folder, in order.
pub(crate) fn files(dir: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(dir) else { return Vec::new() };
    let mut entries: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    let mut files = Vec::new();
    for path in entries {
        if path.is_dir() {
            files.extend(self::files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

/// Whether a file holds tests only, by its name.
pub(crate) fn is_test_file(path: &Path) -> bool {
    path.components().any(|part| {
        let name = part.as_os_str().to_str().unwrap_or("").trim_end_matches(".rs");
        name == "tests" || name == "testing" || name.ends_with("_tests")
    })
}

/// Returns the words and marks of a text; strings, characters and comments are left out.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut tokens = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        match (at(i), at(i + 1)) {
            ('/', '/') => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1;
                }
            }
            ('/', '*') => {
                i += 2;
                while i < chars.len() && (at(i), at(i + 1)) != ('*', '/') {
                    i += 1;
                }
                i += 2;
            }
            ('"', _) => i = string_end(&chars, i, 0),
            ('r', '"' | '#') | ('b', '"') => {
                let hashes = chars[i + 1..].iter().take_while(|c| **c == '#').count();
                if at(i + 1 + hashes) == '"' {
                    let raw = if at(i) == 'r' { hashes + 1 } else { 0 };
                    i = string_end(&chars, i + 1 + hashes, raw);
                } else {
                    i += 1 + hashes;
                }
            }
            ('\'', '\\') => {
                i += 3;
                while i < chars.len() && at(i) != '\'' {
                    i += 1;
                }
                i += 1;
            }
            ('\'', _) if at(i + 2) == '\'' => i += 3,
            (':', ':') => {
                tokens.push("::".to_owned());
                i += 2;
            }
            (c, _) if is_word(c) => {
                let len = chars[i..].iter().take_while(|c| is_word(**c)).count();
                tokens.push(chars[i..i + len].iter().collect());
                i += len;
            }
            (c, _) => {
                if !c.is_whitespace() {
                    tokens.push(c.to_string());
                }
                i += 1;
            }
        }
    }
    tokens
}

/// Returns the index behind a string that begins at its quote; `raw` is 0, or one more than its `#`.
fn string_end(chars: &[char], quote: usize, raw: usize) -> usize {
    let mut i = quote + 1;
    while i < chars.len() {
        let is_end = || raw == 0 || chars[i + 1..].iter().take(raw - 1).all(|c| *c == '#');
        if raw == 0 && chars[i] == '\\' {
            i += 1;
        } else if chars[i] == '"' && is_end() {
            return i + raw.max(1);
        }
        i += 1;
    }
    i
}

/// Whether the tokens begin with `#[cfg(test)]` or `#[cfg(all(test, …))]`.
pub(crate) fn is_test_attribute(tokens: &[Token]) -> bool {
    let attribute: String = tokens.iter().take(8).cloned().collect();
    attribute.starts_with("#[cfg(test)") || attribute.starts_with("#[cfg(all(test")
}

/// Returns the index behind the item that begins at `start`: its `;` or its closing brace.
pub(crate) fn item_end(tokens: &[Token], start: usize) -> usize {
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(start) {
        match token.as_str() {
            "{" => depth += 1,
            "}" if depth <= 1 => return i + 1,
            "}" => depth -= 1,
            ";" if depth == 0 => return i + 1,
            _ => {}
        }
    }
    tokens.len()
}

/// Returns the tokens without items that exist in test builds only.
pub(crate) fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let mut kept = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        if is_test_attribute(&tokens[i..]) {
            i = item_end(tokens, i);
        } else {
            kept.push(tokens[i].clone());
            i += 1;
        }
    }
    kept
}

/// Returns each path of a `use` tree (what lies between `use` and `;`) with the name that it gets.
pub(crate) fn use_tree(tokens: &[Token]) -> Vec<(Vec<String>, String)> {
    let mut out = Vec::new();
    walk(tokens, &mut 0, &[], &mut out);
    out.retain(|(path, _)| !path.is_empty());
    out
}

fn walk(tokens: &[Token], i: &mut usize, prefix: &[String], out: &mut Vec<(Vec<String>, String)>) {
    let mut path = prefix.to_vec();
    while let Some(token) = tokens.get(*i) {
        *i += 1;
        match token.as_str() {
            "::" => {}
            "{" => {
                while tokens.get(*i).is_some_and(|t| *t != "}") {
                    walk(tokens, i, &path, out);
                    if tokens.get(*i).is_some_and(|t| *t == ",") {
                        *i += 1;
                    }
                }
                *i += 1;
                return;
            }
            "as" => {
                let name = tokens.get(*i).cloned().unwrap_or_default();
                *i += 1;
                out.push((path, name));
                return;
            }
            "," | "}" => {
                *i -= 1;
                break;
            }
            "self" if !path.is_empty() => {}
            name => path.push(name.to_owned()),
        }
    }
    let name = path.last().cloned().unwrap_or_default();
    out.push((path, name));
}

/// Returns every path that is named, in `use` trees and elsewhere, as the text says it.
pub(crate) fn named_paths(tokens: &[Token]) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        if tokens[i] == "use" {
            let len = tokens[i..].iter().position(|t| *t == ";").unwrap_or(1);
            paths.extend(use_tree(&tokens[i + 1..i + len]).into_iter().map(|(path, _)| path));
            i += len;
        } else if is_name(&tokens[i]) {
            let mut path = vec![tokens[i].clone()];
            while tokens.get(i + 1).is_some_and(|t| *t == "::")
                && tokens.get(i + 2).is_some_and(|t| is_name(t))
            {
                path.push(tokens[i + 2].clone());
                i += 2;
            }
            paths.push(path);
        }
        i += 1;
    }
    paths
}

#[test]
fn strings_comments_and_test_items_are_no_part_of_the_source() {
    let text = r##"
        use a::{b, c::{self, D as E}}; // f
        /* g */ const H: &str = "i\"j"; const K: &str = r#"l"m"#; const N: char = 'o'; fn p<'q>() {}
        #[cfg(test)] mod tests { fn r() { s(); } }
        fn t() { u::v() }
    "##;
    let tokens = without_tests(&tokens(text));
    let names: Vec<_> = tokens.iter().filter(|t| t.len() == 1 && is_name(t)).cloned().collect();
    assert_eq!(names.concat(), "abcDEHKNpqtuv");
    let paths: Vec<_> = named_paths(&tokens).into_iter().map(|path| path.join("::")).collect();
    assert_eq!(paths[..3], ["a::b", "a::c", "a::c::D"]);
    assert!(paths.contains(&"u::v".to_owned()));
}
