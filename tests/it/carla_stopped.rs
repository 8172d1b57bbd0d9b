//! A client of CARLA's protocol that stops reading has no effect on others.

use bus::Role;

use crate::{
    carla::with_carla_server,
    carla_wire::{Connection, Listener},
    kit::{eventually, resident_bytes},
};

const SIZE: [u32; 2] = [1280, 720];
const IMAGE_BYTES: u64 = 4 * 1280 * 720;
/// The most bytes of messages that wait for one listener.
const BACKLOG_BYTES: u64 = 64 << 20;
const TICKS: u64 = 60;
const UNREAD_CALLS: usize = 400;

/// Everything here happens while one client reads nothing: its sockets are open, as those of a
/// process that was stopped with SIGSTOP.
#[test]
fn ticks_calls_and_images_of_others_go_on_while_a_client_reads_nothing() {
    let (sim, port) = with_carla_server(&["--device", "null"]);
    let gateway = sim.pid(Role::Client).unwrap();
    let mut stopped = Connection::open(port);
    let mut other = Connection::open(port);
    other.set_synchronous();
    let (_, stream) = other.spawn_camera(SIZE);
    let mut images = Listener::open(&mut other, stream);
    let mut states = Listener::open(&mut other, 1);
    // The state that a new listener receives at once.
    states.next();
    let round = |other: &mut Connection, images: &mut Listener, states: &mut Listener| {
        let frame = other.tick();
        let image = images.next();
        assert_eq!((image.frame, image.bytes as u64 > IMAGE_BYTES), (frame, true));
        while states.next().frame < frame {}
        other.call_each_kind();
    };
    for _ in 0..3 {
        round(&mut other, &mut images, &mut states);
    }
    let before = resident_bytes(gateway);

    // From here on, this client reads neither images, nor states, nor answers.
    let _unread = [Listener::open(&mut stopped, stream), Listener::open(&mut stopped, 1)];
    for _ in 0..UNREAD_CALLS {
        stopped.send("get_actor_definitions", 0, |_| {});
    }
    for _ in 0..TICKS {
        round(&mut other, &mut images, &mut states);
    }
    other.call_traffic_manager();
    let (_, second) = other.spawn_camera([64, 32]);
    let mut more = Listener::open(&mut other, second);
    round(&mut other, &mut images, &mut states);
    more.next();

    const { assert!(TICKS * IMAGE_BYTES > 3 * BACKLOG_BYTES) };
    eventually("messages to the client that reads nothing are dropped", || {
        sim.log().contains("is too slow: messages are dropped")
    });
    let grown = resident_bytes(gateway).saturating_sub(before);
    assert!(grown < BACKLOG_BYTES + (48 << 20), "the server has grown by {grown} bytes");
    // Nothing was discarded of what it has called, and it goes on where it has stopped.
    for _ in 0..UNREAD_CALLS {
        stopped.answer("get_actor_definitions");
    }
    drop((stopped, other));
    let log = sim.end();
    assert!(!log.contains("panicked"), "{log}");
}
