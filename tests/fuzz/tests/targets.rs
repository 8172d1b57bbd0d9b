//! Every target on its corpus and on mutations of it. This is the only test of its program, because
//! the bytes that are allocated are counted over all threads.

use omnibus_fuzz::{CountingAllocator, Session, TARGETS, folder, is_soak, seeds};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// The largest file of the corpus, and the largest corpus. Bytes.
const FILE_MAX: usize = 4096;
const CORPUS_MAX: usize = 300_000;

#[test]
fn no_input_panics_or_exceeds_the_work_of_its_target() {
    let is_soak = is_soak();
    let mut corpus = 0;
    for target in TARGETS {
        for (path, bytes) in seeds(target.name).unwrap() {
            assert!(bytes.len() < FILE_MAX, "{}: {} bytes", path.display(), bytes.len());
            corpus += bytes.len();
        }
        let count = target.executions[usize::from(is_soak)];
        let summary = match Session::new(target, is_soak).run(count, 1) {
            Ok(summary) => summary,
            Err(why) => panic!("{why}"),
        };
        println!("fuzz {}: {summary}", target.name);
        assert!(summary.accepted > 0, "{}: no input was accepted", target.name);
        assert!(summary.accepted < summary.executions, "{}: every input was", target.name);
    }
    assert!(corpus < CORPUS_MAX, "{corpus} bytes in {}", folder("").display());
    let soak: u64 = TARGETS.iter().map(|target| target.executions[1]).sum();
    assert_eq!(soak, 10_000_000);
}
