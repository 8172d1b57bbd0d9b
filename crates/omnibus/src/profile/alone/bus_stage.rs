//! The bus alone: a snapshot through shared memory, from the host's writer to a client's reader.

use anyhow::Context;
use bus::{ClientPorts, HostPorts, Instance, clock};
use protocol::{Frame, SnapshotHeader, Stamp};

use super::input::RecordedInput;
use crate::profile::report::Series;

/// Sends each frame once and reads it.
pub(super) fn measure(inputs: &[RecordedInput]) -> anyhow::Result<Vec<Series>> {
    let owned = Instance::create(Some(&format!("profile{}", std::process::id())))?;
    let node = owned.node(true)?;
    let host = HostPorts::create(node)?;
    let client = ClientPorts::open(owned.instance().node("client", true)?)?;
    let (mut all, mut written, mut sent, mut read) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (index, input) in inputs.iter().enumerate() {
        let begin = clock::now_nanos();
        let mut loan = host.snapshot.loan(input.actors.len(), input.limbs.len())?;
        let (actors, limbs) = loan.parts_mut();
        actors.copy_from_slice(&input.actors);
        limbs.copy_from_slice(&input.limbs);
        let copied = clock::now_nanos();
        let stamp = Stamp { frame: Frame(index as u64 + 1), ..input.stamp };
        loan.send(SnapshotHeader { stamp, ..SnapshotHeader::default() })?;
        let delivered = clock::now_nanos();
        let snapshot = client.snapshot.receive()?.context("the snapshot did not arrive")?;
        let taken = clock::now_nanos();
        anyhow::ensure!(
            snapshot.actors().len() == input.actors.len(),
            "{}: {} actors arrived of {}",
            stamp.frame,
            snapshot.actors().len(),
            input.actors.len()
        );
        written.push(copied - begin);
        sent.push(delivered - copied);
        read.push(taken - delivered);
        all.push(taken - begin);
    }
    let series = |name: &str, nanos| Series { name: name.to_owned(), nanos };
    Ok(vec![
        series("bus", all),
        series("write", written),
        series("send", sent),
        series("receive", read),
    ])
}
