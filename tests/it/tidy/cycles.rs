//! Module cycles inside a crate, found in the text of its files.
//!
//! A module reads another one where it names it in a `use` tree or in a path.
//! Test modules, doc comments and the crate root (a table of contents) are left out.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use super::source::{Token, is_name, is_test_attribute, item_end, tokens, use_tree};

/// A module's path inside its crate: `["physics", "model"]`.
type Module = Vec<String>;

/// Returns each group of modules that read each other in a cycle, as one line of text.
pub(crate) fn cycles(src: &Path) -> Vec<String> {
    let mut files = BTreeMap::new();
    let mut root = Vec::new();
    collect(src, &mut Vec::new(), &mut files, &mut root);
    cycles_of(&files, &root)
}

fn collect(
    dir: &Path,
    at: &mut Module,
    files: &mut BTreeMap<Module, Vec<Token>>,
    root: &mut Vec<Token>,
) {
    let mut entries: Vec<_> = fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            if stem != "bin" {
                at.push(stem);
                collect(&path, at, files, root);
                at.pop();
            }
        } else if path.extension().is_some_and(|e| e == "rs") && stem != "main" {
            let tokens = tokens(&fs::read_to_string(&path).unwrap());
            if stem == "lib" && at.is_empty() {
                *root = tokens;
            } else if stem == "mod" {
                files.insert(at.clone(), tokens);
            } else {
                files.insert([at.as_slice(), &[stem]].concat(), tokens);
            }
        }
    }
}

fn cycles_of(files: &BTreeMap<Module, Vec<Token>>, root: &[Token]) -> Vec<String> {
    let mut tests = BTreeSet::new();
    let mut exports = BTreeMap::new();
    let empty = Module::new();
    for (module, tokens) in files.iter().chain([(&empty, &root.to_vec())]) {
        let paths = paths(module, tokens, files);
        tests.extend(paths.tests);
        exports.insert(module.clone(), paths.exports);
    }
    let is_test = |module: &Module| {
        module.iter().any(|name| name == "tests" || name.ends_with("_tests"))
            || tests.iter().any(|test| module.starts_with(test))
    };
    let mut reads: BTreeMap<&Module, BTreeSet<&Module>> = BTreeMap::new();
    for (module, tokens) in files.iter().filter(|(module, _)| !is_test(module)) {
        let entry = reads.entry(module).or_default();
        for path in paths(module, tokens, files).read {
            let Some(target) = resolve(path, files, &exports, 0) else { continue };
            if target != *module && !is_test(&target) {
                entry.insert(files.get_key_value(&target).unwrap().0);
            }
        }
    }
    groups(&reads)
}

/// Returns the module that a path leads to, through re-exports.
fn resolve(
    path: Module,
    files: &BTreeMap<Module, Vec<Token>>,
    exports: &BTreeMap<Module, BTreeMap<String, Module>>,
    depth: usize,
) -> Option<Module> {
    let len = (0..=path.len()).rev().find(|n| *n == 0 || files.contains_key(&path[..*n]))?;
    let (module, rest) = path.split_at(len);
    let next = rest.first().and_then(|name| exports.get(module)?.get(name));
    match next {
        Some(target) if depth < 6 && *target != path => {
            resolve([target.as_slice(), &rest[1..]].concat(), files, exports, depth + 1)
        }
        _ if module.is_empty() => None,
        _ => Some(module.to_vec()),
    }
}

/// What one file names.
#[derive(Default)]
struct Paths {
    /// Paths from the crate's root.
    read: BTreeSet<Module>,
    /// Re-exported names and what they stand for.
    exports: BTreeMap<String, Module>,
    /// Modules that exist in test builds only.
    tests: BTreeSet<Module>,
}

fn paths(file: &Module, tokens: &[Token], files: &BTreeMap<Module, Vec<Token>>) -> Paths {
    let mut paths = Paths::default();
    // Inline modules that are open, each with the brace depth at which it ends.
    let mut inline: Vec<(String, usize)> = Vec::new();
    let (mut depth, mut i) = (0, 0);
    while i < tokens.len() {
        let at: Module = file.iter().chain(inline.iter().map(|(name, _)| name)).cloned().collect();
        let from_root = |path: &[String]| from_root(&at, path, files);
        if is_test_attribute(&tokens[i..]) {
            // `#[cfg(test)] mod name;` or `#[cfg(test)] item { … }`: neither is read.
            let end = item_end(tokens, i);
            let item = &tokens[i..end];
            if let Some(n) = item.iter().position(|t| *t == "mod")
                && item.get(n + 2).is_some_and(|t| *t == ";")
            {
                paths.tests.insert([at.as_slice(), &[item[n + 1].clone()]].concat());
            }
            i = end;
            continue;
        }
        match tokens[i].as_str() {
            "{" => depth += 1,
            "}" => {
                depth -= 1;
                inline.pop_if(|(_, end)| *end == depth);
            }
            "mod" if tokens.get(i + 2).is_some_and(|t| *t == "{") => {
                inline.push((tokens[i + 1].clone(), depth));
            }
            "use" => {
                let is_public = i > 0 && (tokens[i - 1] == "pub" || tokens[i - 1] == ")");
                let len = tokens[i..].iter().position(|t| *t == ";").unwrap_or(1);
                for (path, name) in use_tree(&tokens[i + 1..i + len]) {
                    let Some(path) = from_root(&path) else { continue };
                    if is_public {
                        paths.exports.insert(name, path.clone());
                    }
                    paths.read.insert(path);
                }
                i += len;
            }
            name if is_name(name) && (i == 0 || tokens[i - 1] != "::") => {
                let mut path = vec![name.to_owned()];
                while tokens.get(i + 1).is_some_and(|t| *t == "::")
                    && tokens.get(i + 2).is_some_and(|t| is_name(t))
                {
                    path.push(tokens[i + 2].clone());
                    i += 2;
                }
                if path.len() > 1 {
                    paths.read.extend(from_root(&path));
                }
            }
            _ => {}
        }
        i += 1;
    }
    paths
}

/// Returns a path from the crate's root, or nothing where it leads out of the crate.
fn from_root(
    at: &[String],
    path: &[String],
    files: &BTreeMap<Module, Vec<Token>>,
) -> Option<Module> {
    let child = [at, &path[..1]].concat();
    match path[0].as_str() {
        "crate" => Some(path[1..].to_vec()),
        "self" => Some([at, &path[1..]].concat()),
        "super" => {
            let ups = path.iter().take_while(|name| *name == "super").count();
            Some([&at[..at.len().saturating_sub(ups)], &path[ups..]].concat())
        }
        _ if files.contains_key(&child) => Some([at, path].concat()),
        _ => None,
    }
}

/// Returns the strongly connected groups of more than one module (Tarjan 1972).
fn groups(reads: &BTreeMap<&Module, BTreeSet<&Module>>) -> Vec<String> {
    struct Search<'a> {
        reads: &'a BTreeMap<&'a Module, BTreeSet<&'a Module>>,
        index: BTreeMap<&'a Module, usize>,
        low: BTreeMap<&'a Module, usize>,
        stack: Vec<&'a Module>,
        groups: Vec<String>,
    }
    fn visit<'a>(search: &mut Search<'a>, module: &'a Module) {
        let index = search.index.len();
        search.index.insert(module, index);
        search.low.insert(module, index);
        search.stack.push(module);
        let reads = search.reads;
        for next in reads.get(module).into_iter().flatten() {
            let found = if !search.index.contains_key(next) {
                visit(search, next);
                search.low[next]
            } else if search.stack.contains(next) {
                search.index[next]
            } else {
                continue;
            };
            let low = search.low.get_mut(module).unwrap();
            *low = found.min(*low);
        }
        if search.low[module] == index {
            let start = search.stack.iter().position(|m| *m == module).unwrap();
            let group = search.stack.split_off(start);
            if group.len() > 1 {
                search.groups.push(describe(&group, search.reads));
            }
        }
    }
    let mut search = Search {
        reads,
        index: BTreeMap::new(),
        low: BTreeMap::new(),
        stack: Vec::new(),
        groups: Vec::new(),
    };
    for module in reads.keys() {
        if !search.index.contains_key(module) {
            visit(&mut search, module);
        }
    }
    search.groups
}

fn describe(group: &[&Module], reads: &BTreeMap<&Module, BTreeSet<&Module>>) -> String {
    let mut group = group.to_vec();
    group.sort();
    let lines = group.iter().map(|module| {
        let inside: Vec<_> =
            reads[module].iter().filter(|m| group.contains(m)).map(|m| m.join("::")).collect();
        format!("{} reads {}", module.join("::"), inside.join(", "))
    });
    lines.collect::<Vec<_>>().join("; ")
}

fn check(files: &[(&str, &str)], expected: &[&str]) {
    let mut modules = BTreeMap::new();
    let mut root = Vec::new();
    for (path, text) in files {
        if *path == "lib" {
            root = tokens(text);
        } else {
            modules.insert(path.split("::").map(str::to_owned).collect(), tokens(text));
        }
    }
    assert_eq!(cycles_of(&modules, &root), expected);
}

#[test]
fn a_cycle_of_modules_is_found_and_a_tree_is_not() {
    check(&[("a", "use crate::b::B;"), ("b", "struct B;")], &[]);
    check(
        &[("a", "use crate::{b::{B, C}, c};"), ("b", "fn f() -> crate::a::A {}"), ("c", "")],
        &["a reads b; b reads a"],
    );
    // A parent that uses its child, whose items use the parent.
    check(
        &[("a", "mod b; fn f() { b::g() }"), ("a::b", "use super::A;")],
        &["a reads a::b; a::b reads a"],
    );
    // Through a re-export of the root.
    check(
        &[("lib", "pub use b::B;"), ("a", "use crate::B;"), ("b", "use crate::a;")],
        &["a reads b; b reads a"],
    );
    // Only declared; only in comments, strings and tests.
    check(&[("a", "mod b;"), ("a::b", "use super::A;")], &[]);
    check(
        &[
            ("a", "use crate::b;"),
            (
                "b",
                "// crate::a\nconst S: &str = \"crate::a\"; #[cfg(test)] mod tests { use crate::a; }",
            ),
        ],
        &[],
    );
    check(
        &[("a", "use crate::b;"), ("b", "#[cfg(test)] mod check;"), ("b::check", "use crate::a;")],
        &[],
    );
}
