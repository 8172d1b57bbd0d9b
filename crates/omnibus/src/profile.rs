//! `omnibus profile`: where the time of a frame goes, in a running simulator or in one of its own.

mod alone;
mod args;
mod compare;
pub(crate) mod limit;
mod live;
pub(crate) mod report;
pub(crate) mod sampler;
pub(crate) mod spans;
mod trace;

use anyhow::{Context, ensure};

pub(crate) use args::ProfileArgs;

/// Profiles a simulator.
pub(crate) fn profile(args: &ProfileArgs) -> anyhow::Result<()> {
    ensure!(args.frames > 0, "--frames is 0, must be at least 1");
    for (what, pixels) in [("--width", args.width), ("--height", args.height)] {
        ensure!((16..=8192).contains(&pixels), "{what} is {pixels}; use 16 to 8192");
    }
    ensure!(
        args.pipeline <= protocol::PIPELINE_MAX,
        "--pipeline is {}; use 0 to {}",
        args.pipeline,
        protocol::PIPELINE_MAX
    );
    if let Some([a, b]) = args.compare.as_deref() {
        let comparison = compare::Comparison::of_files(a, b)?;
        return finish(args, &comparison.json(), || comparison.text());
    }
    if let (Some(stage), Some(input)) = (args.stage, &args.input) {
        let report = alone::alone(args, stage, input)?;
        return finish(args, &report.json(), || report.text());
    }
    ensure!(
        args.start || args.sensors.is_none(),
        "--sensors has no effect on a simulator that runs; use --start or --stage render"
    );
    let run = if args.start { live::started(args)? } else { live::attached(args)? };
    if let Some(path) = &args.trace {
        let trace = trace::chrome_trace(&run);
        std::fs::write(path, trace).with_context(|| path.display().to_string())?;
    }
    let report = report::Report::of(&run);
    finish(args, &report.json(), || report.text())
}

/// Writes the result where the arguments say.
fn finish(
    args: &ProfileArgs,
    json: &serde_json::Value,
    text: impl FnOnce() -> String,
) -> anyhow::Result<()> {
    if let Some(path) = &args.output {
        std::fs::write(path, json.to_string()).with_context(|| path.display().to_string())?;
    }
    if args.json {
        print_line!("{json}");
    } else {
        print_line!("{}", text());
    }
    Ok(())
}
