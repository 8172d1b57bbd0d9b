//! `omnibus map validate`.

use super::{Source, speak};
use crate::launch::WorldArgs;
use anyhow::anyhow;
use road::Severity;

/// Lists everything that does not fit together; fails if there are errors.
pub(super) fn validate(source: &Source) -> anyhow::Result<()> {
    let episode = WorldArgs::of_map(&source.map).episode()?;
    let name = &episode.map;
    let findings = road::validate(&episode.open_drive)
        .map_err(|e| anyhow!("{name}:{}: {}", e.line, e.reason))?;
    speak(|out| {
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
        0 => say!("{name}: nothing found"),
        _ => say!("{name}: no errors, {warnings} warnings"),
    }
    Ok(())
}
