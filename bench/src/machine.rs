//! The machine that figures are measured on, and its other load.

use std::{fs, process::Command, time::Duration};

use serde_json::json;

/// The machine before a figure.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    cpu: String,
    cores: usize,
    memory_gib: f64,
    kernel: String,
    /// Load of other processes on all cores, right before the measurement. Percent.
    others_percent: f64,
    pub(crate) commit: String,
}

impl Machine {
    /// Samples the load for half a second in which the benchmark is idle.
    pub(crate) fn look() -> Machine {
        let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
        let field = |text: &str, key: &str| {
            let line = text.lines().find(|line| line.starts_with(key));
            line.and_then(|l| l.split_once(':')).map(|(_, value)| value.trim().to_owned())
        };
        let kibibytes = field(&read("/proc/meminfo"), "MemTotal")
            .and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
        Machine {
            cpu: field(&read("/proc/cpuinfo"), "model name").unwrap_or_else(|| "unknown".into()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            memory_gib: (kibibytes.unwrap_or(0.0) / 1048576.0).round(),
            kernel: read("/proc/sys/kernel/osrelease").trim().to_owned(),
            others_percent: others_percent(),
            commit: commit(),
        }
    }

    pub(crate) fn json(&self) -> serde_json::Value {
        json!({
            "cpu": self.cpu,
            "cores": self.cores,
            "memory_gib": self.memory_gib,
            "kernel": self.kernel,
            "others_percent": self.others_percent,
        })
    }
}

fn others_percent() -> f64 {
    let (busy_before, all_before) = jiffies();
    std::thread::sleep(Duration::from_millis(500));
    let (busy, all) = jiffies();
    let all = all.saturating_sub(all_before).max(1) as f64;
    (busy.saturating_sub(busy_before) as f64 * 100.0 / all).round()
}

/// Returns busy and total CPU time since the machine was started.
fn jiffies() -> (u64, u64) {
    let text = fs::read_to_string("/proc/stat").unwrap_or_default();
    let line = text.lines().next().unwrap_or_default();
    // user, nice, system, idle, iowait, irq, softirq, steal; guests are counted in user.
    let counts: Vec<u64> =
        line.split_whitespace().skip(1).take(8).filter_map(|word| word.parse().ok()).collect();
    let all = counts.iter().sum::<u64>();
    let idle: u64 = counts.iter().skip(3).take(2).sum();
    (all - idle, all)
}

/// Returns the commit that this program was built from.
fn commit() -> String {
    let report = std::env::current_exe().ok().and_then(|exe| {
        let mut git = Command::new("git");
        git.arg("-C").arg(exe.parent()?).args(["rev-parse", "--short", "HEAD"]);
        let output = git.output().ok().filter(|o| o.status.success())?;
        String::from_utf8(output.stdout).ok()
    });
    report.map_or_else(|| "unknown".to_owned(), |text| text.trim().to_owned())
}
