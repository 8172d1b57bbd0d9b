//! The CARLA server, tested with the official `carla` package and with malformed requests.
//!
//! The package is installed once from the Python registry, into a folder of its own. Without Python
//! or the registry the tests are skipped; `OMNIBUS_CARLA=require` makes that a failure, and
//! `OMNIBUS_CARLA_PYTHON` names an interpreter that has the package.

use std::{
    fmt::Write as _,
    fs,
    io::{Read, Write},
    net::TcpStream,
    path::PathBuf,
    process::{Command, Output},
    sync::OnceLock,
};

use serde_json::Value;

use crate::kit::{Scratch, Sim, eventually, kill, note_retried, note_skipped};

const SCRIPTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/carla");
const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/carla-compatibility.md");
/// The text before the rows of the table.
const ABOVE: &str = include_str!("../carla/compatibility-head.md");

/// Returns an interpreter that has the package, or why there is none.
fn python() -> Result<PathBuf, String> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    FOUND.get_or_init(find_python).clone()
}

fn find_python() -> Result<PathBuf, String> {
    if let Some(given) = std::env::var_os("OMNIBUS_CARLA_PYTHON") {
        return Ok(given.into());
    }
    environment("omnibus-it-carla-0.9.16", &["carla==0.9.16", "numpy"], "import carla, numpy")
}

/// Returns the interpreter of a Python environment in a folder of its own, which is created once;
/// or why there is none.
pub(crate) fn environment(name: &str, packages: &[&str], check: &str) -> Result<PathBuf, String> {
    let folder = std::env::temp_dir().join(name);
    let inner = folder.join("bin/python");
    let has_packages = || {
        let import = Command::new(&inner).args(["-c", check]).output();
        import.is_ok_and(|output| output.status.success())
    };
    if has_packages() {
        return Ok(inner);
    }
    let steps: [(&str, Vec<&str>); 2] = [
        ("python3", vec!["-m", "venv", folder.to_str().unwrap_or_default()]),
        (inner.to_str().unwrap_or_default(), [&["-m", "pip", "install", "-q"], packages].concat()),
    ];
    for (program, args) in steps {
        let output = Command::new(program).args(&args).output();
        let output = output.map_err(|e| format!("{program}: {e}"))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            let last = said.lines().last().unwrap_or("").to_owned();
            return Err(format!("{program} {}: {last}", args.join(" ")));
        }
    }
    if has_packages() { Ok(inner) } else { Err("the packages do not import".to_owned()) }
}

/// Returns the interpreter; without one the test is skipped.
pub(crate) fn python_or_skip(test: &str) -> Option<PathBuf> {
    match python() {
        Ok(python) => Some(python),
        Err(why) => {
            let is_required = std::env::var("OMNIBUS_CARLA").is_ok_and(|v| v == "require");
            assert!(!is_required, "the official carla package is not there: {why}");
            note_skipped(test, &format!("the official carla package is not there: {why}"));
            None
        }
    }
}

/// A simulator with a CARLA server, and its port.
pub(crate) fn with_carla_server(args: &[&str]) -> (Sim, u16) {
    let sim = Sim::start(&[&["--carla-port", "0"], args].concat());
    let port = carla_port(&sim, 1);
    (sim, port)
}

/// Returns the port of the `nth` start of the server.
fn carla_port(sim: &Sim, nth: usize) -> u16 {
    let told = || {
        let log = sim.log();
        let line = log.lines().filter(|l| l.contains("CARLA's clients connect to")).nth(nth - 1)?;
        line.rsplit(':').next()?.trim().parse().ok()
    };
    eventually("the CARLA server listens", || told().is_some());
    told().unwrap()
}

fn play(python: &PathBuf, script: &str, port: u16, more: &[&str]) -> Output {
    Command::new(python)
        .arg(format!("{SCRIPTS}/{script}"))
        .arg(port.to_string())
        .args(more)
        .output()
        .unwrap()
}

#[test]
fn the_list_of_members_is_that_of_the_official_package() {
    let Some(python) = python_or_skip("the_list_of_members_is_that_of_the_official_package") else {
        return;
    };
    let output = Command::new(python).arg(format!("{SCRIPTS}/members.py")).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}{words}; `members.py --write` updates the list");
}

/// How threads of the official package abort when they race with each other, and why. The package
/// closes the socket of a stream on one thread while another one uses it. A run that is repeated
/// for this reason is counted and listed.
const RACES: [(&str, &str); 2] = [
    // By the public source of LibCarla (`streaming/detail/tcp/Client.cpp`): `Stop` on the caller's
    // thread and `Connect` on the network thread close it after `is_open` and without a strand.
    ("close: Bad file descriptor", "two of its threads close one socket"),
    // By a core: a listener that was about to be destroyed received a message of the right length,
    // before its content had been read; its zeros are read as a collision.
    ("std::bad_cast", "one of its threads closes a socket while another one reads an image"),
];

#[test]
fn the_official_package_works_as_the_table_says() {
    let Some(python) = python_or_skip("the_official_package_works_as_the_table_says") else {
        return;
    };
    let (mut sim, mut port) = with_carla_server(&[]);
    let mut output = play(&python, "effects.py", port, &[]);
    let words = String::from_utf8_lossy(&output.stderr);
    if let Some((text, what)) = RACES.iter().find(|(text, _)| words.contains(text)) {
        note_retried(
            "the_official_package_works_as_the_table_says",
            &format!("a thread of the package aborted with {text:?}: {what}"),
        );
        sim.end();
        (sim, port) = with_carla_server(&[]);
        output = play(&python, "effects.py", port, &[]);
    }
    let said = String::from_utf8_lossy(&output.stdout);
    let lines: Vec<Value> = said.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
    let failures: Vec<_> = lines.iter().filter_map(|l| l["failure"].as_str()).collect();
    let words = String::from_utf8_lossy(&output.stderr);
    // What failed comes last: a report that keeps only the end of a long message contains it.
    let last = format!("{}\n{words}\nended with {}", sim.log(), output.status);
    assert!(output.status.success() || !failures.is_empty(), "{last}, without a failure: {said}");
    assert!(failures.is_empty(), "{last}\n{}", failures.join("\n"));
    let table = table(&lines);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(TABLE, &table).unwrap();
    }
    let kept = fs::read_to_string(TABLE).unwrap_or_default();
    let found = table.lines().find(|line| !kept.contains(line));
    let gone = kept.lines().find(|line| !table.contains(line));
    assert!(
        kept == table,
        "docs/carla-compatibility.md is out of date, UPDATE_DOCS=1 updates it: {found:?} was \
         observed and is not on the page, {gone:?} is on the page and was not observed"
    );
    sim.end();
}

/// One line per member, one section per class.
fn table(lines: &[Value]) -> String {
    let count = |verdict: &str| lines.iter().filter(|l| l["verdict"] == verdict).count();
    let mut text = ABOVE.to_owned();
    let [works, differs, local] = ["works", "differs", "local"].map(count);
    let [nothing, errors, absent] = ["nothing", "error", "absent"].map(count);
    let _ = writeln!(
        text,
        "{works} rows work, {differs} work with a difference, {local} are in the client only, \
         {nothing} have no effect, {errors} answer an error, {absent} are not in the package."
    );
    let mut above = String::new();
    for line in lines.iter().filter(|line| line["member"].is_string()) {
        let field = |name: &str| line[name].as_str().unwrap_or("").to_owned();
        if field("class") != above {
            above = field("class");
            let _ = writeln!(text, "\n## {above}\n");
            text += "| member | verdict | what was observed |\n|---|---|---|\n";
        }
        let verdict = match field("verdict").as_str() {
            "works" => "works",
            "differs" => "works with a difference",
            "local" => "in the client only",
            "nothing" => "without effect",
            "absent" => "not in the package",
            _ => "answers an error",
        };
        let note = field("note").replace('|', "\\|");
        let _ = writeln!(text, "| `{}` | {verdict} | {note} |", field("member"));
    }
    text
}

#[test]
fn a_queue_for_each_sensor_holds_every_frame_exactly_once() {
    let Some(python) = python_or_skip("a_queue_for_each_sensor_holds_every_frame_exactly_once")
    else {
        return;
    };
    let (sim, port) = with_carla_server(&[]);
    let ticks = if crate::kit::is_soak() { "10000" } else { "500" };
    let output = play(&python, "synchronous.py", port, &[ticks]);
    let words = String::from_utf8_lossy(&output.stderr);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}: {said}{words}\n{}", output.status, sim.log());
    sim.end();
}

#[test]
fn the_package_s_own_walkers_keep_to_sidewalks_and_crosswalks() {
    let Some(python) = python_or_skip("the_package_s_own_walkers_keep_to_sidewalks_and_crosswalks")
    else {
        return;
    };
    let (sim, port) = with_carla_server(&["--map", "Greatmoor"]);
    let seconds = if crate::kit::is_soak() { "600" } else { "60" };
    let output = play(&python, "walkers.py", port, &[seconds]);
    let words = String::from_utf8_lossy(&output.stderr);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}: {said}{words}\n{}", output.status, sim.log());
    assert!(said.contains("none on a road"), "{said}{words}");
    sim.end();
}

#[test]
fn the_package_s_own_walkers_cross_quiet_streets_by_the_cross_factor() {
    let test = "the_package_s_own_walkers_cross_quiet_streets_by_the_cross_factor";
    let Some(python) = python_or_skip(test) else { return };
    let (sim, port) = with_carla_server(&["--map", "Greatmoor"]);
    let output = play(&python, "walkers.py", port, &["120", "1"]);
    let words = String::from_utf8_lossy(&output.stderr);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}: {said}{words}\n{}", output.status, sim.log());
    assert!(!said.contains("none on a road"), "{said}{words}");
    sim.end();
}

#[test]
fn programs_of_carla_0_8_run_with_one_import_changed() {
    let Some(python) = python_or_skip("programs_of_carla_0_8_run_with_one_import_changed") else {
        return;
    };
    let (sim, port) = with_carla_server(&[]);
    let scratch = Scratch::new();
    let output = play(&python, "old_client.py", port, &[scratch.path().to_str().unwrap()]);
    let words = String::from_utf8_lossy(&output.stderr);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}: {said}{words}\n{}", output.status, sim.log());
    assert!(said.ends_with("all of it\n"), "{said}{words}");
    sim.end();
}

/// Encodes a call as the official client does.
fn call(stream: &mut TcpStream, request: &[u8]) -> Option<Vec<u8>> {
    stream.write_all(request).ok()?;
    let mut answer = vec![0; 4096];
    let len = stream.read(&mut answer).ok()?;
    answer.truncate(len);
    (len > 0).then_some(answer)
}

const VERSION: &[u8] = b"\x94\x00\x01\xa7version\x91\x91\xc2";

#[test]
fn malformed_requests_do_not_disturb_other_clients() {
    let (sim, port) = with_carla_server(&[]);
    let mut client = sim.ticker();
    let open = |port: u16| {
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(std::time::Duration::from_secs(20))).unwrap();
        stream
    };
    let idle: Vec<_> = (0..200).map(|_| open(port)).collect();
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        (state >> 33) as u8
    };
    for round in 0..100 {
        let mut stranger = open(port);
        let mut bytes: Vec<u8> = (0..200).map(|_| random()).collect();
        if round % 2 == 0 {
            // A known call with malformed arguments.
            let names: [&[u8]; 3] = [b"\xabspawn_actor", b"\xabapply_batch", b"\xa8tick_cue"];
            let name = names[round / 2 % 3];
            bytes = [b"\x94\x00\x01", name, b"\x93\x91\xc2", &bytes[..]].concat();
        }
        let _ = stranger.write_all(&bytes);
    }
    // Huge lengths, and nested lists.
    for bytes in [&b"\xdd\xff\xff\xff\xff"[..], b"\xdb\xff\xff\xff\xff", &[0x91; 5000]] {
        let mut stranger = open(port);
        let _ = stranger.write_all(bytes);
    }
    let answer = call(&mut open(port), VERSION).unwrap();
    assert!(answer.ends_with(b"0.9.16"), "{answer:?}");
    let frame = client.tick().unwrap();
    assert_eq!(client.tick().unwrap(), frame.next());
    drop(idle);
    drop(client);
    let log = sim.end();
    assert!(!log.contains("panicked"), "{log}");
}

#[test]
fn a_killed_carla_server_is_restarted() {
    let (sim, port) = with_carla_server(&[]);
    let mut client = sim.ticker();
    client.tick().unwrap();
    let control = sim.instance().control().unwrap();
    let server = || {
        let slots = control.slots().iter();
        slots
            .filter(|s| s.name() == protocol::Name::new("gateway"))
            .map(|s| s.pid())
            .find(|p| *p != 0)
    };
    kill(server().unwrap(), rustix::process::Signal::KILL);
    let again = carla_port(&sim, 2);
    assert_eq!(again, port, "clients reach the new server where the former one was");
    let mut stream = TcpStream::connect(("127.0.0.1", again)).unwrap();
    assert!(call(&mut stream, VERSION).unwrap().ends_with(b"0.9.16"));
    client.tick().unwrap();
    drop(client);
    sim.end();
}

/// CARLA's repository is not part of this one: `OMNIBUS_CARLA_EXAMPLES` names its PythonAPI folder.
#[test]
fn carla_s_own_examples_run_unmodified() {
    let Some(api) = std::env::var_os("OMNIBUS_CARLA_EXAMPLES").map(PathBuf::from) else {
        note_skipped(
            "carla_s_own_examples_run_unmodified",
            "OMNIBUS_CARLA_EXAMPLES names no folder",
        );
        return;
    };
    let python = environment("omnibus-it-carla-examples", EXAMPLES_NEED, "import carla, pygame");
    let python = python.unwrap_or_else(|why| panic!("what the examples need is not there: {why}"));
    let scratch = Scratch::new();
    let (sim, port) = with_carla_server(&["--map", "Town03"]);
    let (api, out) = (api.to_str().unwrap(), scratch.path().to_str().unwrap());
    let output = play(&python, "examples.py", port, &[api, out]);
    let said = String::from_utf8_lossy(&output.stdout);
    let lines: Vec<Value> = said.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
    let mut table = EXAMPLES_ABOVE.to_owned();
    for line in &lines {
        let field = |name: &str| line[name].as_str().unwrap_or("").replace('|', "\\|");
        let outcome = match line["failure"].as_str() {
            None => field("observed"),
            Some(_) => format!("**fails**: {}", field("failure")),
        };
        let call = format!("{} {}", field("script"), field("arguments"));
        let _ = writeln!(table, "| {} | `{}` | {outcome} |", field("example"), call.trim());
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(EXAMPLES_TABLE, &table).unwrap();
    }
    print!("{table}");
    let fails = |line: &&Value| line["failure"].is_string();
    let failing: Vec<_> =
        lines.iter().filter(fails).filter_map(|l| l["example"].as_str()).collect();
    let unknown: Vec<_> = failing.iter().filter(|name| !KNOWN_TO_FAIL.contains(name)).collect();
    assert!(unknown.is_empty(), "{unknown:?} fail\n{table}\n{}", sim.log());
    assert!(lines.len() > 35, "only {} examples ran", lines.len());
    sim.end();
}

const EXAMPLES_TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/carla-examples.md");
const EXAMPLES_ABOVE: &str = include_str!("../carla/examples-head.md");
/// Packages that CARLA's scripts import.
const EXAMPLES_NEED: &[&str] = &[
    "carla==0.9.16",
    "numpy",
    "pygame",
    "networkx",
    "shapely",
    "pillow",
    "matplotlib<3.9",
    "psutil",
    "py-cpuinfo",
    "GPUtil",
    "python-tr",
    "setuptools<80",
];
/// These need a screen, or compare a number before they contact the simulator.
const KNOWN_TO_FAIL: &[&str] = &["open3d_lidar", "config_default"];
