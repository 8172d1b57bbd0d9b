//! Shared memory that is full: refused by name, and never a signal.

use std::process::{Command, Stdio};

use mesh::RandomStream;

use crate::kit::{Scratch, is_soak, note_skipped, small_map};

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

/// The program under test, until it ends or is ended: started in `scratch` while files of random sizes
/// come and go in /dev/shm and in the folder of the recording, which holds 24 MiB.
const AT_RANDOM: &str = r#"
    mkdir disk
    mount -t tmpfs -o size=24m tmpfs disk
    for sizes in $SIZES; do
        "$ROLE" record --map "$MAP" --device cpu --vehicles 20 --name random --frames 100000000 \
            --out "$PWD/disk/a.mcap" >said 2>&1 &
        recorder=$!
        for size in $(echo "$sizes" | tr , ' '); do
            head -c "${size%:*}" /dev/zero >/dev/shm/filler 2>&-
            head -c "${size#*:}" /dev/zero >disk/filler 2>&-
            sleep 0.1
            rm -f /dev/shm/filler disk/filler
            sleep 0.05
        done
        kill -INT $recorder 2>&-
        wait $recorder
        echo "run: $?, lines of errors: $(grep -c '^omnibus:' said), panics: $(grep -c panicked said)"
        [ "$(grep -c '^omnibus:' said)" = 0 ] || grep '^omnibus:' said
        if [ -s disk/a.mcap ]; then
            "$ROLE" inspect disk/a.mcap >inspected 2>&1 || echo "inspect: $(grep . inspected | head -1)"
            grep panicked inspected
        fi
        rm -f disk/a.mcap
    done
    echo "left in /dev/shm: $(ls /dev/shm | wc -l)"
"#;

#[test]
fn memory_and_disk_that_fill_up_at_random_end_a_run_by_name_or_not_at_all() {
    let runs = if is_soak() { 200 } else { 4 };
    let mut random = RandomStream::from_state(7);
    let mut size = || format!("{}:{}", random.below(90 << 20), random.below(28 << 20));
    let sizes = (0..runs).map(|_| (0..12).map(|_| size()).collect::<Vec<_>>().join(","));
    let sizes = sizes.collect::<Vec<_>>().join(" ");
    let script = format!("SIZES=\"{sizes}\"\n{AT_RANDOM}");
    let Some(said) = with_small_shared_memory(
        "memory_and_disk_that_fill_up_at_random_end_a_run_by_name_or_not_at_all",
        &script,
    ) else {
        return;
    };
    println!("{said}");
    let count = |outcome: &str| said.lines().filter(|line| *line == outcome).count();
    let went_well = count("run: 0, lines of errors: 0, panics: 0");
    // A stage that lacks a page names the cause itself; where its successor does not start, the host
    // names a second one.
    let refused =
        ["1", "2"].map(|lines| count(&format!("run: 1, lines of errors: {lines}, panics: 0")));
    assert_eq!(went_well + refused.iter().sum::<usize>(), runs, "{said}");
    assert!(!said.contains("panicked"), "{said}");
    let errors = said.lines().filter(|line| line.starts_with("omnibus: "));
    for error in errors {
        let is_named =
            ["/dev/shm", "full", "No space left", "space"].iter().any(|w| error.contains(w));
        assert!(is_named, "{error}");
    }
    assert!(said.contains("left in /dev/shm: 0\n"), "{said}");
}
