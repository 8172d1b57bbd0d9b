//! The two commands of the front page, one after the other in one checkout.

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

use crate::kit::{note_skipped, omnibus};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn git(args: &[&str]) -> Option<Output> {
    Command::new("git").args(args).current_dir(root()).output().ok()
}

/// Untracked files that git does not ignore.
fn strange_files() -> Option<String> {
    let output = git(&["ls-files", "--others", "--exclude-standard"])?;
    output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
}

#[test]
fn the_demo_runs_in_the_checkout_that_is_tested_and_builds_no_dependency_again() {
    let test = "the_demo_runs_in_the_checkout_that_is_tested_and_builds_no_dependency_again";
    let Some(before) = strange_files() else {
        note_skipped(test, "no git checkout");
        return;
    };
    // Another profile would build everything.
    if !env!("CARGO_BIN_EXE_role").contains("/release/") {
        note_skipped(test, "the tests are not built with --release, as the demo is");
        return;
    }
    let ended = Command::new("./run")
        .arg("demo")
        .env("OMNIBUS_DEMO_FRAMES", "5")
        .current_dir(root())
        .output();
    let ended = ended.unwrap();
    let (told, built) =
        (String::from_utf8(ended.stdout).unwrap(), String::from_utf8(ended.stderr).unwrap());
    assert!(ended.status.success(), "{told}{built}");
    // The program itself is built, which the tests do not need; its crates and dependencies are there.
    let compiled = built.lines().filter_map(|line| line.trim().strip_prefix("Compiling "));
    let again: Vec<_> = compiled.filter(|line| !line.starts_with("omnibus-sim v")).collect();
    assert_eq!(again, Vec::<&str>::new(), "the demo compiles what the tests have compiled");
    let set = told.lines().find_map(|line| line.strip_prefix("data set: ")).unwrap();
    let set = root().join(set);
    let inspected = omnibus().arg("inspect").arg(&set).output().unwrap();
    assert!(inspected.status.success(), "{}", String::from_utf8_lossy(&inspected.stderr));
    std::fs::remove_dir_all(set).unwrap();
    assert_eq!(strange_files().unwrap(), before, "the demo leaves files that git does not ignore");
}
