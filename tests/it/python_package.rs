//! The Python package: its wheel, installed into an empty environment outside the checkout.
//!
//! The tests are the programs of `tests/python`. Without Python or the package registry they are
//! skipped.

use std::{
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

use crate::kit::{Scratch, note_skipped, small_map};

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
fn python() -> Result<PathBuf, String> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    FOUND.get_or_init(install).clone()
}

fn install() -> Result<PathBuf, String> {
    output(Command::new("python3").args(["-c", "import ensurepip, venv"]))?;
    let built = Command::new("sh").args(["run", "wheel"]).current_dir(root()).output().unwrap();
    if !built.status.success() {
        let said = String::from_utf8_lossy(&built.stderr);
        assert!(!root().join("target/tools/maturin/bin/maturin").exists(), "{said}");
        return Err(format!("maturin cannot be installed: {said}"));
    }
    let printed = String::from_utf8(built.stdout).unwrap();
    let wheel = root().join(printed.lines().last().unwrap());
    // One for each checkout.
    let checkout = root().to_string_lossy().replace('/', "-");
    let folder = std::env::temp_dir().join(format!("omnibus-it-python{checkout}"));
    output(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    let python = folder.join("bin/python");
    let install = ["-m", "pip", "install", "-q", "--disable-pip-version-check"];
    output(Command::new(&python).args(install).arg(&wheel))?;
    Ok(python)
}

/// Runs a program of `tests/python` outside the checkout, and expects that it succeeds.
fn run(test: &str, script: &str, args: &[&Path]) {
    let python = match python() {
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
    assert!(!said.contains("panicked"), "{script}: {said}");
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
