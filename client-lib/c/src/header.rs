//! The header in `include/` is the one that cbindgen writes from this source.

use std::{env, fs, path::Path};

use cbindgen::{Builder, Config, DocumentationStyle, EnumConfig, Language, RenameRule, Style};

/// The files with declarations, in the order of the header.
const SOURCES: [&str; 7] = ["status", "client", "world", "actors", "map", "bundle", "radar"];

const HEAD: &str = "\
/*
 * The C interface of the driving simulator Omnibus. The manual is docs/c.md.
 *
 * SI units and radians. World and vehicle space are right-handed, x forward (world: east), y left
 * (world: north), z up.
 *
 * A call returns a status; omnibus_last_error() has the text of what went wrong. A result is written
 * only if the status is OMNIBUS_STATUS_OK.
 *
 * A pointer argument is NULL or points to what its type says, until the call returns; texts are
 * UTF-8 and end with a zero byte. NULL gives OMNIBUS_STATUS_ARGUMENT unless the function allows it.
 * What a function hands over to the caller is released once, with the function that its text names,
 * in any order and from any thread.
 *
 * A forked child must not call these functions with what its parent has made.
 *
 * cbindgen wrote this file from client-lib/c/src; do not edit it.
 */";

fn generated() -> String {
    let config = Config {
        language: Language::C,
        cpp_compat: true,
        pragma_once: true,
        header: Some(HEAD.to_owned()),
        documentation_style: DocumentationStyle::Doxy,
        style: Style::Both,
        usize_is_size_t: true,
        line_length: 100,
        enumeration: EnumConfig {
            rename_variants: RenameRule::QualifiedScreamingSnakeCase,
            ..EnumConfig::default()
        },
        ..Config::default()
    };
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let builder = SOURCES.iter().fold(Builder::new().with_config(config), |builder, name| {
        builder.with_src(sources.join(name).with_extension("rs"))
    });
    let mut text = Vec::new();
    builder.generate().unwrap().write(&mut text);
    String::from_utf8(text).unwrap()
}

/// `UPDATE_DOCS=1` writes it.
#[test]
fn the_header_is_that_of_the_source() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/omnibus.h");
    let header = generated();
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, &header).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == header, "{} is not current; UPDATE_DOCS=1 renews it", path.display());
}

/// Every function of the source is in the header: none is lost because its types are unknown.
#[test]
fn the_header_declares_every_exported_function() {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let header = generated();
    let mut count = 0;
    for name in SOURCES {
        let text = fs::read_to_string(sources.join(name).with_extension("rs")).unwrap();
        for after in text.split("pub extern \"C\" fn ").skip(1) {
            let function = after.split('(').next().unwrap();
            assert!(header.contains(&format!("{function}(")), "{function} is not in the header");
            count += 1;
        }
    }
    assert!(count > 20, "{count} functions");
}
