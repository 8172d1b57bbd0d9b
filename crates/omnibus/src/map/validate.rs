//! `omnibus map validate`.

use crate::launch::WorldArgs;
use crate::map::{output::write_stdout, source::Source};
use anyhow::anyhow;
use road::Severity;

/// Lists every contradiction in the map; fails if there are errors.
pub(super) fn validate(source: &Source) -> anyhow::Result<()> {
    let episode = WorldArgs::of_map(&source.map).episode()?;
    let name = &episode.map;
    let findings = road::validate(&episode.open_drive)
        .map_err(|e| anyhow!("{name}:{}: {}", e.line, e.reason))?;
    write_stdout(|out| {
        for finding in &findings {
            let severity = finding.severity.text();
            writeln!(out, "{name}:{}: {severity}: {}", finding.line, finding.reason)?;
        }
        Ok(())
    })?;
    let of = |severity| findings.iter().filter(|finding| finding.severity == severity).count();
    let (errors, warnings) = (of(Severity::Error), of(Severity::Warning));
    anyhow::ensure!(errors == 0, "{name}: {errors} errors, {warnings} warnings");
    match warnings {
        0 => print_line!("{name}: nothing found"),
        _ => print_line!("{name}: no errors, {warnings} warnings"),
    }
    Ok(())
}
