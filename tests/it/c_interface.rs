//! The C interface: programs in C, compiled with every warning, against a real simulator.
//!
//! Where the compiler has AddressSanitizer, each program runs with it, too: an access to memory that
//! was given back, and memory that is never given back, end the program with an error.

use std::{
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::OnceLock,
};

use rustix::process::Signal;

use crate::kit::{Scratch, Sim, kill, note_skipped, run_asynchronously};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns the folder of the library, which is built once, beside the program under test and the
/// benchmarks.
pub(crate) fn library() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let folder = Path::new(env!("CARGO_BIN_EXE_role")).parent().unwrap();
        // With the program: then it shares the program's build of each dependency.
        let built = Command::new(env!("CARGO"))
            .args(["build", "--release", "--offline"])
            .args(["-p", "omnibus-c", "-p", "omnibus-sim", "-p", "omnibus-bench"])
            .arg("--target-dir")
            .arg(folder.parent().unwrap())
            .current_dir(root())
            .output()
            .unwrap();
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        folder.to_owned()
    })
}

/// Compiles a program, or returns what the compiler says.
fn compile(source: &str, into: &Path, options: &[&str]) -> Result<PathBuf, String> {
    let program = into.join(format!("program{}", options.len()));
    let library = library().to_str().unwrap();
    let compiled = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-g", "-pthread"])
        .args(options)
        .arg(format!("-I{}", root().join("client-lib/c/include").display()))
        .arg(root().join(source))
        .args([&format!("-L{library}"), "-lomnibus", "-lm", &format!("-Wl,-rpath,{library}"), "-o"])
        .arg(&program)
        .output()
        .map_err(|e| format!("cc: {e}"))?;
    if compiled.status.success() {
        return Ok(program);
    }
    Err(String::from_utf8_lossy(&compiled.stderr).into_owned())
}

/// Compiles a program without and with AddressSanitizer. The second is skipped where an empty
/// program cannot be compiled with it.
fn programs(test: &str, source: &str, into: &Path) -> Vec<PathBuf> {
    const SANITIZER: &[&str] = &["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let mut programs = vec![compile(source, into, &[]).unwrap()];
    let empty = into.join("empty.c");
    std::fs::write(&empty, "int main(void) { return 0; }\n").unwrap();
    match compile(empty.to_str().unwrap(), into, SANITIZER) {
        Ok(_) => programs.push(compile(source, into, SANITIZER).unwrap()),
        Err(why) => note_skipped(test, &format!("no AddressSanitizer: {why}")),
    }
    programs
}

fn start(program: &Path, args: &[&str]) -> Child {
    let mut command = Command::new(program);
    command.args(args).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Returns what it prints; it must succeed.
fn end(child: Child) -> String {
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{}: {said}", ended.status);
    String::from_utf8(ended.stdout).unwrap()
}

#[test]
fn the_c_example_lockstep_agent_drives_along_its_lane() {
    let test = "the_c_example_lockstep_agent_drives_along_its_lane";
    let folder = Scratch::new();
    let source = "client-lib/c/examples/lockstep_agent.c";
    for program in programs(test, source, folder.path()) {
        let sim = Sim::start(&[]);
        let said = end(start(&program, &[sim.instance().id()]));
        // "drove 60.1 m in 10.0 s, at most 0.31 m beside the lane's centre"
        let numbers: Vec<f32> = said.split(' ').filter_map(|word| word.parse().ok()).collect();
        let [driven_m, _, deviation_m] = numbers[..] else { panic!("{said}") };
        assert!(driven_m > 30.0, "{said}");
        assert!(deviation_m < 1.0, "{said}");
        sim.end();
    }
}

fn plays(test: &str, job: &str) {
    let folder = Scratch::new();
    for program in programs(test, "tests/c/interface.c", folder.path()) {
        let sim = Sim::start(&[]);
        end(start(&program, &[sim.instance().id(), job]));
        sim.end();
    }
}

#[test]
fn c_reads_what_sensors_measured_until_it_releases_it() {
    plays("c_reads_what_sensors_measured_until_it_releases_it", "sensors");
}

#[test]
fn a_radar_in_c_detects_a_car_that_drives_away() {
    plays("a_radar_in_c_detects_a_car_that_drives_away", "radar");
}

#[test]
fn wrong_uses_of_the_c_interface_get_a_status_and_a_text() {
    plays("wrong_uses_of_the_c_interface_get_a_status_and_a_text", "wrong");
}

#[test]
fn a_c_program_survives_a_killed_simulator() {
    let test = "a_c_program_survives_a_killed_simulator";
    let folder = Scratch::new();
    for program in programs(test, "tests/c/interface.c", folder.path()) {
        let mut sim = Sim::start(&[]);
        let mut child = start(&program, &[sim.instance().id(), "killed"]);
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        out.read_line(&mut line).unwrap();
        if line == "ready\n" {
            kill(sim.host_pid(), Signal::KILL);
        }
        let mut rest = String::new();
        out.read_to_string(&mut rest).unwrap();
        end(child);
        sim.wait();
    }
}

#[test]
fn the_first_program_of_the_c_manual_runs() {
    let folder = Scratch::new();
    let sim = Sim::start(&[]);
    run_asynchronously(&mut sim.client("ticker"));
    let manual = std::fs::read_to_string(root().join("docs/c.md")).unwrap();
    let block = manual.split("```c\n").nth(1).unwrap().split("```").next().unwrap();
    // Other tests have simulators of their own at the same time, so that it must name this one.
    let named = format!("\"hello\", \"{}\",", sim.instance().id());
    assert!(block.contains("\"hello\", NULL,"), "{block}");
    let source = folder.path().join("hello.c");
    std::fs::write(&source, block.replace("\"hello\", NULL,", &named)).unwrap();
    let program = compile(source.to_str().unwrap(), folder.path(), &[]).unwrap();
    let said = end(start(&program, &[]));
    assert_eq!(said.lines().filter(|line| line.starts_with("frame ")).count(), 10, "{said}");
    sim.end();
}
