//! CARLA's command line for `omnibus run`: its switches are translated into options before parsing.
//! Unreal's switches begin with one dash, carry values after `=`, and ignore case.

use std::ffi::OsString;

use anyhow::{Context, bail, ensure};

/// Switches about a window or sound. They are accepted and have no effect.
const WITHOUT_EFFECT: [&str; 9] = [
    "carla-server",
    "renderoffscreen",
    "windowed",
    "fullscreen",
    "opengl",
    "vulkan",
    "nosound",
    "carla-no-hud",
    "nohmd",
];

/// Translates CARLA's switches; all other arguments stay as they are.
pub(crate) fn translate(args: impl Iterator<Item = OsString>) -> anyhow::Result<Vec<OsString>> {
    let args: Vec<OsString> = args.collect();
    if args.get(1).is_none_or(|verb| verb != "run") {
        return Ok(args);
    }
    let mut result: Vec<OsString> = Vec::new();
    let (mut is_benchmark, mut fps) = (false, None);
    for arg in args {
        let Some(switch) = switch(&arg) else {
            result.push(arg);
            continue;
        };
        let (name, value) = switch.split_once('=').unwrap_or((&switch, ""));
        match name {
            "carla-rpc-port" | "carla-port" | "carla-world-port" => {
                result.extend(["--carla-port".into(), value.into()]);
            }
            "quality-level" => {
                ensure!(
                    ["low", "epic"].contains(&value),
                    "-quality-level is {value:?}; use Low or Epic"
                );
                result.extend(["--quality".into(), value.into()]);
            }
            "no-rendering" | "nullrhi" => result.push("--no-rendering".into()),
            "benchmark" => is_benchmark = true,
            "fps" => fps = Some(value.to_owned()),
            "resx" | "resy" => {}
            _ if WITHOUT_EFFECT.contains(&name) => {}
            // Not a switch of CARLA: clap reports the error.
            _ => result.push(arg),
        }
    }
    match (is_benchmark, fps) {
        (true, Some(fps)) => {
            let rate: f64 =
                fps.parse().with_context(|| format!("-fps is {fps:?}, not a number"))?;
            ensure!((1.0..=1e4).contains(&rate), "-fps is {fps}; use 1 to 10000");
            let delta = (1.0 / rate).to_string();
            result.extend(["--fixed-delta", &delta, "--real-time-factor", "0"].map(Into::into));
        }
        (true, None) => bail!("-benchmark needs the frames per simulated second: -fps=N"),
        (false, Some(fps)) => bail!("-fps={fps} has a meaning only together with -benchmark"),
        (false, None) => {}
    }
    Ok(result)
}

/// Returns an argument that begins with one dash, without the dash and in lower case.
fn switch(arg: &OsString) -> Option<String> {
    let switch = arg.to_str()?.strip_prefix('-')?;
    (!switch.starts_with('-')).then(|| switch.to_ascii_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(line: &str) -> Result<String, String> {
        let args = line.split(' ').map(OsString::from);
        let result = translate(args).map_err(|e| e.to_string())?;
        Ok(result.iter().map(|a| a.to_str().unwrap()).collect::<Vec<_>>().join(" "))
    }

    #[test]
    fn switches_of_carla_become_options() {
        for (given, ours) in [
            ("omnibus run -carla-server", "omnibus run"),
            ("omnibus run -carla-rpc-port=2010", "omnibus run --carla-port 2010"),
            ("omnibus run -carla-port=3000 --seed 2", "omnibus run --carla-port 3000 --seed 2"),
            ("omnibus run -quality-level=Low -RenderOffScreen", "omnibus run --quality low"),
            ("omnibus run -quality-level=Epic -ResX=800 -windowed", "omnibus run --quality epic"),
            ("omnibus run -no-rendering", "omnibus run --no-rendering"),
            (
                "omnibus run -benchmark -fps=20",
                "omnibus run --fixed-delta 0.05 --real-time-factor 0",
            ),
        ] {
            assert_eq!(result(given).as_deref(), Ok(ours), "{given}");
        }
    }

    #[test]
    fn other_arguments_stay_as_they_are() {
        for line in ["omnibus run -h", "omnibus run -x=1", "omnibus maps -benchmark", "omnibus"] {
            assert_eq!(result(line).as_deref(), Ok(line));
        }
    }

    #[test]
    fn an_invalid_value_is_refused() {
        for (line, word) in [
            ("omnibus run -quality-level=High", "Low or Epic"),
            ("omnibus run -benchmark", "-fps=N"),
            ("omnibus run -fps=20", "-benchmark"),
            ("omnibus run -benchmark -fps=0", "1 to 10000"),
            ("omnibus run -benchmark -fps=fast", "not a number"),
        ] {
            let refusal = result(line).unwrap_err();
            assert!(refusal.contains(word), "{line}: {refusal}");
        }
    }
}
