//! The Python package: its wheel, installed into an empty environment outside the checkout.
//!
//! The tests are the programs of `tests/python`. Without Python or the package registry they are
//! skipped.

use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::{Arc, OnceLock},
};

use environment::{Action, Cache, Config, Environment, EnvironmentMap};

use crate::{
    carla::environment,
    kit::{Scratch, note_skipped, small_map},
};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// The output of a command, or why it failed: its last line.
fn output(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|e| format!("{:?}: {e}", command.get_program()))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    Err(said.lines().last().unwrap_or("it failed without a reason").to_owned())
}

/// Returns the interpreter of an environment that has the wheel and nothing else; or why there is
/// none.
pub(crate) fn python() -> Result<PathBuf, String> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    FOUND.get_or_init(|| install("omnibus-it-python", &wheel()?, &[])).clone()
}

/// Returns the interpreter of an environment that has the wheel and what `omnibus.gym` needs; or why
/// there is none.
fn gym_python() -> Result<PathBuf, String> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let packages = ["gymnasium==1.4.0", "pettingzoo==1.27.0"];
    FOUND.get_or_init(|| install("omnibus-it-python-gym", &wheel()?, &packages)).clone()
}

/// Returns the wheel, built once; or why it cannot be built.
fn wheel() -> Result<PathBuf, String> {
    static BUILT: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    BUILT.get_or_init(build_wheel).clone()
}

fn build_wheel() -> Result<PathBuf, String> {
    output(Command::new("python3").args(["-c", "import ensurepip, venv"]))?;
    let built = Command::new("sh").args(["run", "wheel"]).current_dir(root()).output().unwrap();
    if !built.status.success() {
        let said = String::from_utf8_lossy(&built.stderr);
        assert!(!root().join("target/tools/maturin/bin/maturin").exists(), "{said}");
        return Err(format!("maturin cannot be installed: {said}"));
    }
    let printed = String::from_utf8(built.stdout).unwrap();
    Ok(root().join(printed.lines().last().unwrap()))
}

/// Makes an environment with the wheel and packages.
fn install(name: &str, wheel: &Path, packages: &[&str]) -> Result<PathBuf, String> {
    // One for each checkout.
    let checkout = root().to_string_lossy().replace('/', "-");
    let folder = std::env::temp_dir().join(format!("{name}{checkout}"));
    output(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    let python = folder.join("bin/python");
    let install = ["-m", "pip", "install", "-q", "--disable-pip-version-check"];
    output(Command::new(&python).args(install).arg(wheel).args(packages))?;
    Ok(python)
}

/// Runs a program of `tests/python` outside the checkout, and expects that it succeeds.
fn run(test: &str, script: &str, args: &[&Path]) {
    run_with(python(), test, script, args);
}

fn run_with(python: Result<PathBuf, String>, test: &str, script: &str, args: &[&Path]) {
    let python = match python {
        Ok(python) => python,
        Err(why) => return note_skipped(test, &format!("no Python environment: {why}")),
    };
    let folder = Scratch::new();
    let ended = Command::new(python)
        .args(["-X", "faulthandler", "-W", "error"])
        .arg(root().join("tests/python").join(script))
        .args(args)
        .current_dir(folder.path())
        .env_clear()
        .env("HOME", folder.path())
        .env("PATH", "/usr/bin:/bin")
        .env("OMNIBUS_CACHE", std::env::temp_dir().join("omnibus-it-cache"))
        .env("OMNIBUS_TEST_MAP", small_map())
        .output()
        .unwrap();
    println!("{}", String::from_utf8_lossy(&ended.stdout));
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{script}: {}\n{said}", ended.status);
    for fault in ["panicked", "ResourceWarning", "Exception ignored"] {
        assert!(!said.contains(fault), "{script}: {said}");
    }
}

#[test]
fn the_wheel_is_the_entire_installation() {
    let test = "the_wheel_is_the_entire_installation";
    run(test, "quick_start.py", &[&root().join("docs/python.md")]);
}

#[test]
fn python_s_views_are_valid_while_they_are_referenced() {
    run("python_s_views_are_valid_while_they_are_referenced", "views.py", &[]);
}

#[test]
fn python_s_radars_detect_a_car_that_drives_away() {
    run("python_s_radars_detect_a_car_that_drives_away", "radar.py", &[]);
}

#[test]
fn python_s_keypoints_are_those_of_the_walker_that_a_camera_sees() {
    run("python_s_keypoints_are_those_of_the_walker_that_a_camera_sees", "labels.py", &[]);
}

#[test]
fn python_s_simulators_end_and_nothing_hangs_or_crashes() {
    run("python_s_simulators_end_and_nothing_hangs_or_crashes", "processes.py", &[]);
}

#[test]
fn the_examples_of_the_python_package_run() {
    let test = "the_examples_of_the_python_package_run";
    run(test, "examples.py", &[&root().join("client-lib/python/examples")]);
}

/// The state hash of forty steps of an environment, as `tests/python/gym_environments.py` makes them.
fn hash_of_forty_steps() -> u64 {
    let text = fs::read_to_string(small_map()).unwrap();
    let map = EnvironmentMap::load(&Cache::disabled(), small_map(), &text, 3).unwrap();
    let config = Config { vehicles: 4, route_m: 80.0, ..Config::default() };
    let mut environment = Environment::new(Arc::new(map), config, 7).unwrap();
    for step in 0..40 {
        let steer = if step % 20 < 10 { 0.05 } else { -0.05 };
        environment.step(&[Action::Pedals { steer, pedal: 0.3 }]).unwrap();
    }
    environment.simulation().sim().state_hash()
}

#[test]
fn gymnasium_and_pettingzoo_accept_the_environments_and_their_hashes_are_rust_s() {
    let hash = hash_of_forty_steps().to_string();
    run_with(
        gym_python(),
        "gymnasium_and_pettingzoo_accept_the_environments_and_their_hashes_are_rust_s",
        "gym_environments.py",
        &[&root().join("docs/gym.md"), Path::new(&hash), &gym_examples()],
    );
}

fn gym_examples() -> PathBuf {
    root().join("client-lib/python/examples/gym")
}

#[test]
fn python_s_followers_keep_their_lane_and_their_gap() {
    let test = "python_s_followers_keep_their_lane_and_their_gap";
    run(test, "agents.py", &[&root().join("client-lib/python/examples")]);
}

/// Two workers of a local Ray cluster, one of which is killed.
#[test]
fn a_collection_on_ray_has_the_bytes_of_one_process_although_a_worker_is_killed() {
    let test = "a_collection_on_ray_has_the_bytes_of_one_process_although_a_worker_is_killed";
    let python =
        wheel().and_then(|wheel| install("omnibus-it-python-ray", &wheel, &["ray==2.60.0"]));
    run_with(python, test, "ray_scenes.py", &[]);
}

/// The quick start of the manual and the examples have no fault either.
#[test]
fn mypy_and_pyright_accept_the_package_and_its_stubs_describe_it() {
    let test = "mypy_and_pyright_accept_the_package_and_its_stubs_describe_it";
    let checkers = || {
        let python = python()?;
        let checkers = environment(
            "omnibus-it-python-types",
            &[
                "mypy==2.4.1",
                "pyright==1.1.414",
                "numpy==2.4.6",
                "gymnasium==1.4.0",
                "pettingzoo==1.27.0",
            ],
            "import mypy, pyright, numpy, gymnasium, pettingzoo",
        )?;
        // It downloads itself when it is used first.
        output(Command::new(&checkers).args(["-m", "pyright", "--version"]))?;
        Ok::<_, String>((python, checkers))
    };
    let (python, checkers) = match checkers() {
        Ok(found) => found,
        Err(why) => return note_skipped(test, &format!("no Python environment: {why}")),
    };
    let folder = Scratch::new();
    for (page, name) in [("docs/python.md", "quick_start"), ("docs/gym.md", "gym_page")] {
        let page = fs::read_to_string(root().join(page)).unwrap();
        // The quick start of the one page, and every example of the other.
        let blocks = page.split("```python\n").skip(1);
        let count = if name == "quick_start" { 1 } else { usize::MAX };
        for (index, block) in blocks.take(count).enumerate() {
            let program = block.split("```").next().unwrap();
            fs::write(folder.path().join(format!("{name}_{index}.py")), program).unwrap();
        }
    }
    for examples in [root().join("client-lib/python/examples"), gym_examples()] {
        for example in fs::read_dir(examples).unwrap().flatten() {
            if example.path().extension().is_some_and(|extension| extension == "py") {
                fs::copy(example.path(), folder.path().join(example.file_name())).unwrap();
            }
        }
    }
    let packages = "import sysconfig; print(sysconfig.get_path('purelib'))";
    let packages = output(Command::new(&python).args(["-c", packages])).unwrap();
    let package = Path::new(packages.trim()).join("omnibus");
    let allowed = root().join("tests/python/stubtest-allowed.txt");
    let check = |args: &[&dyn AsRef<OsStr>]| {
        let mut command = Command::new(&checkers);
        command
            .arg("-m")
            .args(args.iter().map(|arg| (*arg).as_ref()))
            .current_dir(folder.path())
            .env("PYTHONPATH", packages.trim());
        let ended = command.output().unwrap();
        let said = String::from_utf8_lossy(&ended.stdout);
        assert!(ended.status.success(), "{said}{}", String::from_utf8_lossy(&ended.stderr));
    };
    check(&[&"mypy", &"--strict", &".", &package]);
    check(&[&"pyright", &"--pythonpath", &checkers, &"."]);
    check(&[&"mypy.stubtest", &"omnibus", &"--allowlist", &allowed]);
}
