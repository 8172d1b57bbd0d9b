//! `omnibus profile`: where the time of a frame goes, in a running simulator or in one of its own.

mod args;
mod limit;
mod live;
mod report;
mod sampler;
mod spans;
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
    let run = if args.start { live::started(args)? } else { live::attached(args)? };
    if let Some(path) = &args.trace {
        let trace = trace::chrome_trace(&run);
        std::fs::write(path, trace).with_context(|| path.display().to_string())?;
    }
    let report = report::Report::of(&run);
    let json = report.json();
    if let Some(path) = &args.output {
        let text = serde_json::to_string(&json)?;
        std::fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    if args.json {
        print_line!("{json}");
    } else {
        print_line!("{}", report.text());
    }
    Ok(())
}
