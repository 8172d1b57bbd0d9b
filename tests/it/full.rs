//! Shared memory that is full: refused by name, and never a signal.

use std::process::{Command, Stdio};

use crate::kit::{Scratch, note_skipped, small_map};

/// Runs a script in a mount namespace of its own, where /dev/shm holds 80 MiB. `$ROLE` is the program
/// under test and `$MAP` the small map. Returns what it printed; `None` if this machine allows no
/// namespaces.
fn with_small_shared_memory(test: &str, script: &str) -> Option<String> {
    let inside = |script: &str| {
        let mount = "mount -t tmpfs -o size=80m tmpfs /dev/shm";
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "--pid", "--fork", "--mount-proc"]);
        command.args(["sh", "-c", &format!("{mount} && {{ {script}\n}}")]);
        command.stdin(Stdio::null());
        command
    };
    match inside("true").output() {
        Ok(output) if output.status.success() => {}
        _ => {
            note_skipped(test, "this machine allows no user namespaces");
            return None;
        }
    }
    let scratch = Scratch::new();
    let mut command = inside(script);
    command.env("ROLE", env!("CARGO_BIN_EXE_role")).env("MAP", small_map());
    command.env("OMNIBUS_CACHE", scratch.path()).current_dir(scratch.path());
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Some(text(&output.stdout) + &text(&output.stderr))
}

#[test]
fn a_simulator_that_runs_survives_and_a_second_one_is_refused() {
    let script = r#"
        "$ROLE" record --map "$MAP" --device cpu --name first --frames 100000000 --out "$PWD/a.mcap" &
        first=$!
        while ! [ -s a.mcap ]; do sleep 0.05; done
        dd if=/dev/zero of=/dev/shm/filler bs=64k 2>&1 | grep -c 'No space left'
        "$ROLE" record --map "$MAP" --device cpu --name second --frames 10 --out "$PWD/b.mcap"
        echo "second: $?"
        before=$(stat -c %s a.mcap)
        sleep 2
        [ "$(stat -c %s a.mcap)" -gt "$before" ] && echo "first still records"
        kill -INT $first
        wait $first
        echo "first: $?"
    "#;
    let Some(said) = with_small_shared_memory(
        "a_simulator_that_runs_survives_and_a_second_one_is_refused",
        script,
    ) else {
        return;
    };
    println!("{said}");
    assert!(said.contains("second: 1\n"), "{said}");
    assert!(said.contains("/dev/shm has 0 MB free"), "{said}");
    assert!(said.contains("first still records"), "{said}");
    assert!(said.contains("first: 0\n"), "{said}");
}
