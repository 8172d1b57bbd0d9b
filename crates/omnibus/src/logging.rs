//! The log on standard error: one line per event, `LEVEL crate frame message`.
//!
//! Every crate logs through the macros of `log`; a message about a frame begins with its number.
//! `OMNIBUS_LOG` chooses the lines: a level for all crates of this workspace, and `crate=level` for
//! one of them or for a library, as in `warn,traffic=debug,wgpu_hal=info`.

use std::io::Write;

use log::{Level, LevelFilter, Log, Metadata, Record};

/// The environment variable that holds the filter.
const VARIABLE: &str = "OMNIBUS_LOG";

/// Installs the logger of this process with the filter of `OMNIBUS_LOG`, or `info`.
///
/// # Errors
///
/// Returns the part of the filter that is not a level.
pub(crate) fn init() -> anyhow::Result<()> {
    let text = std::env::var(VARIABLE).unwrap_or_default();
    let filter = Filter::parse(&text)?;
    log::set_max_level(filter.max());
    // A second logger is a second call of `main` in one process: the first one stays.
    let _ = log::set_boxed_logger(Box::new(Stderr { filter }));
    Ok(())
}

/// Which lines are written.
#[derive(Debug)]
struct Filter {
    /// For crates of this workspace that `crates` does not name.
    default: LevelFilter,
    crates: Vec<(String, LevelFilter)>,
}

impl Filter {
    fn parse(text: &str) -> anyhow::Result<Filter> {
        let mut filter = Filter { default: LevelFilter::Info, crates: Vec::new() };
        for part in text.split(',').filter(|part| !part.is_empty()) {
            let (name, level) = part.split_once('=').map_or((None, part), |(n, l)| (Some(n), l));
            let level = level.parse().map_err(|_| {
                anyhow::anyhow!(
                    "{VARIABLE}: {level:?} is not a log level; use off, error, warn, info, debug \
                     or trace"
                )
            })?;
            match name {
                Some(name) => filter.crates.push((name.to_owned(), level)),
                None => filter.default = level,
            }
        }
        Ok(filter)
    }

    fn max(&self) -> LevelFilter {
        self.crates.iter().map(|(_, level)| *level).fold(self.default, Ord::max)
    }

    fn allows(&self, target: &str, level: Level) -> bool {
        let (name, is_own) = crate_of(target);
        let of_crate = self.crates.iter().rfind(|(n, _)| *n == name).map(|(_, level)| *level);
        let default = if is_own { self.default } else { LevelFilter::Off };
        level <= of_crate.unwrap_or(default)
    }
}

/// Returns the crate of a log target, as its folder is named, and whether it is of this workspace.
fn crate_of(target: &str) -> (String, bool) {
    let name = target.split("::").next().unwrap_or(target);
    match name.strip_prefix("omnibus_") {
        Some(own) => (own.replace('_', "-"), true),
        None => (name.to_owned(), name == "omnibus"),
    }
}

struct Stderr {
    filter: Filter,
}

impl Log for Stderr {
    fn enabled(&self, metadata: &Metadata) -> bool {
        self.filter.allows(metadata.target(), metadata.level())
    }

    fn log(&self, record: &Record) {
        if self.enabled(record.metadata()) {
            let (name, _) = crate_of(record.target());
            // One write for a line: processes share standard error.
            let line = format!("{} {name} {}\n", record.level(), record.args());
            let _ = std::io::stderr().write_all(line.as_bytes());
        }
    }

    fn flush(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crates_are_named_by_their_folders() {
        assert_eq!(crate_of("omnibus_sim_host::host::slots"), ("sim-host".to_owned(), true));
        assert_eq!(crate_of("omnibus::maps"), ("omnibus".to_owned(), true));
        assert_eq!(crate_of("wgpu_hal::vulkan"), ("wgpu_hal".to_owned(), false));
    }

    #[test]
    fn a_filter_has_a_default_and_levels_of_crates() {
        let filter = Filter::parse("warn,traffic=debug,wgpu_hal=info").unwrap();
        for (target, level, is_allowed) in [
            ("omnibus_sim_host", Level::Warn, true),
            ("omnibus_sim_host", Level::Info, false),
            ("omnibus_traffic::run", Level::Debug, true),
            ("wgpu_hal", Level::Info, true),
            ("naga", Level::Error, false),
        ] {
            assert_eq!(filter.allows(target, level), is_allowed, "{target} {level}");
        }
        assert_eq!(filter.max(), LevelFilter::Debug);
        assert!(Filter::parse("").unwrap().allows("omnibus", Level::Info));
    }

    #[test]
    fn a_filter_that_is_not_a_level_is_refused_by_name() {
        let error = Filter::parse("loud").unwrap_err().to_string();
        assert!(error.contains("OMNIBUS_LOG") && error.contains("\"loud\""), "{error}");
    }
}
