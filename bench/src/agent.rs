//! Agents in processes of their own: one in Rust, which is this program, and programs in C, Python
//! and with the official `carla` package. All do the same, and print when they read which frame.

use std::{
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::Duration,
};

use anyhow::{Context, ensure};
use client_lib::{ActorId, Client, Frame, clock, wire::VehicleControl};

use crate::{scene, sim::omnibus};

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

/// Arguments of the agent in Rust.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    instance: String,
    actor: u32,
}

/// The agent in Rust: for each line `loop COUNT` on standard input it prints as many lines.
pub(crate) fn play(args: &Args) -> anyhow::Result<()> {
    let mut client = Client::connect(Some(&args.instance), "agent")?;
    client.synchronise(Duration::from_nanos(scene::DELTA_NANOS))?;
    let car = ActorId(args.actor);
    println!("ready");
    let mut turns = 0_u32;
    for line in std::io::stdin().lines() {
        let line = line?;
        let count = line.strip_prefix("loop ").and_then(|count| count.parse::<usize>().ok());
        let mut measured = Vec::with_capacity(count.context("a line is not \"loop COUNT\"")?);
        for _ in 0..measured.capacity() {
            turns += 1;
            // Each answer differs from the one before.
            let steer = (turns % 512) as f32 / 1024.0;
            let control =
                VehicleControl { actor_id: car, brake: 1.0, steer, ..VehicleControl::default() };
            client.control(&[control])?;
            let frame = client.tick()?;
            let state = client.world().state(car).context("the car is gone")?;
            let (position_m, found) = (state.pose.position_m[0], state.steer);
            measured.push((frame, clock::now_nanos()));
            ensure!(
                found == steer && position_m.is_finite(),
                "frame {frame} shows steer {found}, not {steer}"
            );
        }
        for (frame, nanos) in measured {
            println!("{} {nanos}", frame.0);
        }
    }
    Ok(())
}

/// A language in which an agent is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Language {
    Rust,
    C,
    Python,
    Carla,
}

impl Language {
    pub(crate) const ALL: [Language; 4] =
        [Language::Rust, Language::C, Language::Python, Language::Carla];

    /// Returns the command that starts the agent, but for its arguments; or why there is none.
    /// Programs are compiled into `folder`.
    pub(crate) fn program(self, folder: &Path) -> anyhow::Result<Result<Vec<String>, String>> {
        let python = |variable: &str, script: &str| match std::env::var(variable) {
            Ok(python) => Ok(vec![python, format!("{FOLDER}/{script}")]),
            Err(_) => Err(variable.to_owned()),
        };
        Ok(match self {
            Language::Rust => {
                let own = std::env::current_exe().context("where is this program?")?;
                Ok(vec![own.display().to_string(), "agent".to_owned()])
            }
            Language::C => compile(folder)?,
            Language::Python => python("OMNIBUS_PYTHON", "loop_agent.py").map_err(|variable| {
                format!("{variable} names no Python that has the package omnibus")
            }),
            Language::Carla => python("OMNIBUS_CARLA_PYTHON", "loop_agent_carla.py")
                .map_err(|variable| format!("{variable} names no Python that has carla 0.9.16")),
        })
    }
}

/// Compiles the agent in C with the library beside this program.
fn compile(folder: &Path) -> anyhow::Result<Result<Vec<String>, String>> {
    let omnibus = omnibus()?;
    let beside = omnibus.parent().context("the program has no folder")?;
    if !beside.join("libomnibus.so").is_file() {
        let why = "libomnibus.so is not beside this program; build it: cargo build --release";
        return Ok(Err(why.to_owned()));
    }
    let (program, beside) = (folder.join("loop_agent").display().to_string(), beside.display());
    let compiled = Command::new("cc")
        .args(["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror"])
        .arg(format!("-I{FOLDER}/../client-lib/c/include"))
        .arg(format!("{FOLDER}/loop_agent.c"))
        .args([&format!("-L{beside}"), "-lomnibus", &format!("-Wl,-rpath,{beside}")])
        .args(["-o", &program])
        .output();
    let Ok(compiled) = compiled else { return Ok(Err("there is no C compiler, cc".to_owned())) };
    let said = String::from_utf8_lossy(&compiled.stderr);
    ensure!(compiled.status.success(), "cc {FOLDER}/loop_agent.c: {said}");
    Ok(Ok(vec![program]))
}

/// The process of an agent, which holds the tick. It ends when it is dropped.
pub(crate) struct Agent {
    child: Child,
    lines: BufReader<ChildStdout>,
    input: Option<ChildStdin>,
}

impl Agent {
    /// Starts it; `world` is the name of the instance, or the port of the CARLA server.
    pub(crate) fn start(program: &[String], world: &str, car: ActorId) -> anyhow::Result<Agent> {
        let mut child = Command::new(&program[0])
            .args(&program[1..])
            .args([world, &car.0.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| program[0].clone())?;
        let lines = BufReader::new(child.stdout.take().expect("it is piped"));
        let input = child.stdin.take();
        let mut agent = Agent { child, lines, input };
        let first = agent.line()?;
        ensure!(first == "ready", "{} printed {first:?}, not \"ready\"", program.join(" "));
        Ok(agent)
    }

    fn line(&mut self) -> anyhow::Result<String> {
        let mut line = String::new();
        ensure!(self.lines.read_line(&mut line)? > 0, "an agent has ended; its error is above");
        Ok(line.trim_end().to_owned())
    }

    /// Lets it tick `count` times; returns the frames, and the nanoseconds that it printed.
    pub(crate) fn run(&mut self, job: &str, count: usize) -> anyhow::Result<Vec<(Frame, u64)>> {
        let input = self.input.as_mut().expect("it is taken only by drop");
        input.write_all(format!("{job} {count}\n").as_bytes()).context("an agent has ended")?;
        let read = |line: String| -> Option<(Frame, u64)> {
            let (frame, nanos) = line.split_once(' ')?;
            Some((Frame(frame.parse().ok()?), nanos.parse().ok()?))
        };
        (0..count)
            .map(|_| read(self.line()?).context("an agent printed no frame and time"))
            .collect()
    }
}

impl Drop for Agent {
    fn drop(&mut self) {
        // The end of its input is the end of its work.
        drop(self.input.take());
        let _ = self.child.wait();
    }
}
