//! Clients that break CARLA's protocol, or use it to harm others.

use std::{
    fs,
    io::{Read, Write},
    net::{TcpListener, TcpStream},
};

use carla_gateway::msgpack::{Pack, Value};

use crate::{
    carla::with_carla_server,
    carla_wire::{Connection, Listener, READ_TIMEOUT, value},
    kit::{Scratch, Sim, eventually, small_map},
    refuse::{names, refusal},
};

/// A call of `version` as the official client sends it.
const VERSION: &[u8] = b"\x94\x00\x01\xa7version\x91\x91\xc2";

/// Sends bytes, and returns all that is received until the connection is closed.
fn received(port: u16, bytes: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(READ_TIMEOUT)).unwrap();
    // A server that closes the connection meanwhile may reset it.
    let _ = stream.write_all(bytes);
    let mut all = Vec::new();
    match stream.read_to_end(&mut all) {
        Ok(_) => all,
        Err(e) if e.kind() == std::io::ErrorKind::ConnectionReset => all,
        Err(e) => panic!("the connection stays open: {e}"),
    }
}

/// A web page can make a browser send such a request to any port of its own host.
#[test]
fn a_call_in_the_body_of_an_http_request_is_not_executed() {
    let (sim, port) = with_carla_server(&[]);
    let mut other = Connection::open(port);
    let manager = other.traffic_manager_port();
    let streams = other.stream_port();
    let head = format!(
        "POST / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: {}\r\n\r\n",
        VERSION.len()
    );
    for port in [port, manager, streams] {
        let answer = received(port, &[head.as_bytes(), VERSION].concat());
        assert!(answer.is_empty(), "port {port} answers {answer:?}");
    }
    // After a call, too, nothing but another call is accepted.
    let answer = received(port, &[VERSION, head.as_bytes(), VERSION].concat());
    let versions = answer.windows(6).filter(|bytes| bytes == b"0.9.16").count();
    assert_eq!(versions, 1, "{answer:?}");
    other.call("version", 0, |_| {});
    drop(other);
    let log = sim.end();
    assert!(log.contains("is it another protocol, HTTP for instance?"), "{log}");
}

/// CARLA's protocol has no authentication: whoever reaches the port may name any file.
#[test]
fn clients_write_and_read_files_only_in_the_folder_of_recordings() {
    let scratch = Scratch::new();
    let folder = scratch.path().join("recordings");
    let path = |name: &str| scratch.path().join(name).to_str().unwrap().to_owned();
    let (victim, inside) = (path("victim.mcap"), path("recordings/notes.txt"));
    fs::create_dir(&folder).unwrap();
    fs::write(&inside, "a file of the user").unwrap();
    std::os::unix::fs::symlink(scratch.path(), folder.join("out")).unwrap();
    let (sim, port) = with_carla_server(&["--recordings", folder.to_str().unwrap()]);
    let mut client = Connection::open(port);
    client.set_synchronous();

    let start = |client: &mut Connection, name: &str| {
        client.refusal("start_recorder", 2, |args| {
            args.text(name).bool(true);
        })
    };
    // A recording, too, which would be replaced inside of the folder.
    for content in ["", "a file of the user"] {
        fs::write(&victim, content).unwrap();
        for name in [&*victim, "../victim.mcap", "/etc/omnibus-it/new.mcap"] {
            let why = start(&mut client, name);
            assert!(why.contains("--recordings") && why.contains("/recordings"), "{why}");
        }
        let why = start(&mut client, "out/victim.mcap");
        assert!(why.contains("out is a link"), "{why}");
        assert_eq!(fs::read_to_string(&victim).unwrap(), content);
    }
    let why = start(&mut client, "notes.txt");
    assert!(why.contains("is not a recording"), "{why}");
    assert_eq!(fs::read_to_string(&inside).unwrap(), "a file of the user");

    let recorded = value(client.call("start_recorder", 2, |args| {
        args.text("sub/run.mcap").bool(true);
    }));
    let Value::Text(recorded) = recorded else { panic!("{recorded:?}") };
    assert!(recorded.ends_with("/recordings/sub/run.mcap"), "{recorded}");
    client.tick();
    client.call("stop_recorder", 0, |_| {});
    for name in ["sub/run.mcap", &recorded] {
        let info = value(client.call("show_recorder_file_info", 2, |args| {
            args.text(name).bool(false);
        }));
        assert!(matches!(&info, Value::Text(text) if text.contains("Frames: ")), "{info:?}");
    }
    let read = |client: &mut Connection, method: &str, more: fn(&mut Pack) -> usize, name: &str| {
        let count = more(&mut Pack::new());
        client.refusal(method, 1 + count, |args| {
            args.text(name);
            more(args);
        })
    };
    type More = fn(&mut Pack) -> usize;
    let readers: [(&str, More); 4] = [
        ("show_recorder_file_info", |args| {
            args.bool(false);
            1
        }),
        ("show_recorder_collisions", |args| {
            args.uint(97).uint(97);
            2
        }),
        ("show_recorder_actors_blocked", |args| {
            args.f64(1.0).f64(1.0);
            2
        }),
        ("replay_file", |args| {
            args.f64(0.0).f64(0.0).uint(0).bool(false);
            4
        }),
    ];
    for (method, more) in readers {
        for name in [&*victim, "../victim.mcap", "out/victim.mcap"] {
            let why = read(&mut client, method, more, name);
            assert!(why.contains("folder of recordings"), "{method}: {why}");
        }
    }
    // Maps are loaded by name.
    for name in [small_map(), "/dev/zero", "../hamlet", "Carla/Maps/../../x"] {
        let why = client.refusal("load_new_episode", 3, |args| {
            args.text(name).bool(false).uint(0xffff);
        });
        assert!(why.contains("clients load maps by name"), "{why}");
    }
    drop(client);
    sim.end();
}

#[test]
fn pipes_and_devices_block_nothing() {
    let scratch = Scratch::new();
    let folder = scratch.path();
    let pipe = folder.join("pipe.mcap");
    let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, mode).unwrap();
    let pipe = pipe.to_str().unwrap();
    let what = &["pipe.mcap", "a named pipe, not a regular file"];
    names(&refusal(&["run", "--map", pipe]), what);
    names(&refusal(&["inspect", pipe]), what);
    names(&refusal(&["replay", pipe]), what);
    names(&refusal(&["map", "info", "/dev/zero"]), &["/dev/zero", "a device, not a regular file"]);

    let (sim, port) = with_carla_server(&["--recordings", folder.to_str().unwrap()]);
    let mut client = Connection::open(port);
    let why = client.refusal("show_recorder_file_info", 2, |args| {
        args.text("pipe.mcap").bool(false);
    });
    assert!(why.contains("not a regular file"), "{why}");
    // Native clients of the same user name any path.
    let mut native = sim.ticker();
    for (path, what) in [(pipe, "a named pipe"), ("/dev/zero", "a device")] {
        for said in [
            native.load_map(path).unwrap_err(),
            native.start_replay(path, client_lib::Replay::default()).unwrap_err(),
            native.start_recorder(path, client_lib::Profile::State).unwrap_err(),
            native.load_state_from(std::path::Path::new(path)).unwrap_err(),
        ] {
            assert!(said.to_string().contains(what), "{said}");
        }
    }
    native.tick().unwrap();
    drop((client, native));
    sim.end();
}

#[test]
fn idle_connections_give_way_to_new_clients() {
    let (sim, port) = with_carla_server(&[]);
    let mut first = Connection::open(port);
    first.call("version", 0, |_| {});
    let streams = first.stream_port();
    for port in [port, streams] {
        // More than a port has room for.
        let _idle: Vec<_> =
            (0..1100).map(|_| TcpStream::connect(("127.0.0.1", port)).unwrap()).collect();
        let mut new = Connection::open(first.port());
        new.set_synchronous();
        let mut states = Listener::open(&mut new, 1);
        let frame = new.tick();
        while states.next().frame < frame {}
        // A client that has made calls stays connected, however long it is idle.
        first.call("version", 0, |_| {});
    }
    drop(first);
    let log = sim.end();
    assert!(log.contains("has been idle longest and is closed for a new one"), "{log}");
}

#[test]
fn a_server_without_descriptors_closes_idle_connections() {
    let (sim, port) = with_carla_server(&[]);
    let gateway = sim.pid(bus::Role::Client).unwrap();
    let open = fs::read_dir(format!("/proc/{gateway}/fd")).unwrap().count() as u64;
    let limit = rustix::process::Rlimit { current: Some(open + 20), maximum: Some(open + 20) };
    let pid = rustix::process::Pid::from_raw(gateway as i32);
    rustix::process::prlimit(pid, rustix::process::Resource::Nofile, limit).unwrap();
    let idle: Vec<_> = (0..100).map(|_| TcpStream::connect(("127.0.0.1", port)).unwrap()).collect();
    let mut new = Connection::open(port);
    new.call("version", 0, |_| {});
    new.call_each_kind();
    drop((idle, new));
    let log = sim.end();
    assert!(log.contains("cannot accept a connection: Too many open files"), "{log}");
}

#[test]
fn a_taken_port_ends_the_program_and_names_the_options() {
    // Above a port that nothing else on the machine has.
    let (port, taken) = std::iter::repeat_with(|| TcpListener::bind("127.0.0.1:0").unwrap())
        .map(|taken| (taken.local_addr().unwrap().port(), taken))
        .find(|(port, _)| TcpListener::bind(("127.0.0.1", port - 1)).is_ok())
        .unwrap();
    for carla_port in [port, port - 1] {
        let port_arg = carla_port.to_string();
        let said = refusal(&["run", "--map", small_map(), "--carla-port", &port_arg]);
        names(&said, &[&format!("127.0.0.1:{port}"), "--carla-port", "--no-carla"]);
    }
    drop(taken);
    // The ports of a simulator that has just ended, with connections that the system still keeps.
    let port = port.to_string();
    for _ in 0..2 {
        let sim = Sim::start(&["--carla-port", &port]);
        eventually("the CARLA server listens", || sim.log().contains("clients connect to"));
        let mut client = Connection::open(port.parse().unwrap());
        client.call("version", 0, |_| {});
        sim.end();
    }
}

#[test]
fn a_port_that_others_reach_is_described() {
    let scratch = Scratch::new();
    let folder = scratch.path().to_str().unwrap();
    let (sim, port) = with_carla_server(&["--listen", "0.0.0.0", "--recordings", folder]);
    let log = sim.end();
    let line = log.lines().find(|line| line.contains("no authentication")).unwrap();
    names(line, &["0.0.0.0", &port.to_string(), "every host", folder, "--listen 127.0.0.1"]);
}

#[test]
fn an_oversized_request_is_answered_with_its_limit() {
    let (sim, port) = with_carla_server(&[]);
    let mut client = Connection::open(port);
    client.set_synchronous();
    let batch = |client: &mut Connection, count: usize, write: fn(&mut Pack)| {
        client.refusal("apply_batch", 2, |args| {
            args.list(count);
            (0..count).for_each(|_| write(args));
            args.bool(false);
        })
    };
    // As the official package sends them.
    let transform = |args: &mut Pack| {
        args.list(1).list(2).uint(6).list(2).uint(1).list(2).vector([0.0; 3]).vector([0.0; 3]);
    };
    let destruction = |args: &mut Pack| {
        args.list(1).list(2).uint(1).list(1).uint(1);
    };
    names(
        &batch(&mut client, 200_000, transform),
        &["request too large", "apply_batch", "2097152"],
    );
    names(&batch(&mut client, 200_000, destruction), &["a batch of 200000 commands", "131072"]);
    let why = client.refusal("get_actors_by_id", 1, |args| {
        args.list(100_000);
        (0..100_000).for_each(|_| {
            args.uint(1);
        });
    });
    names(&why, &["100000 ids", "65536"]);
    let long = "x".repeat(100_000);
    let why = client.refusal("spawn_actor", 2, |args| {
        args.list(3).uint(0).text("sensor.other.imu").list(1);
        args.list(3).text("role_name").uint(4).text(&long);
        args.list(2).vector([0.0; 3]).vector([0.0; 3]);
    });
    names(&why, &["sensor.other.imu", "64 KiB"]);
    client.tick();
    drop(client);
    let log = sim.end();
    assert!(!log.contains("panicked"), "{log}");
}

#[test]
fn a_batch_of_destructions_has_the_outcome_of_each() {
    let (sim, port) = with_carla_server(&[]);
    let mut client = Connection::open(port);
    client.set_synchronous();
    let cars = [0.0, 30.0].map(|x| client.spawn("vehicle.audi.tt", &[], [x, 0.0, 60.0]));
    let sensor = client.spawn("sensor.other.imu", &[], [0.0; 3]);
    client.tick();
    let spectator = 1 << 24;
    let ids = [cars[0], cars[1], cars[0], 999, sensor, sensor, spectator];
    let results = client.call("apply_batch", 2, |args| {
        args.list(ids.len() + 1);
        for id in ids {
            args.list(1).list(2).uint(1).list(1).uint(id);
        }
        // Another command ends the run of destructions.
        args.list(1).list(2).uint(14).list(2).uint(cars[1]).bool(true);
        args.bool(true);
    });
    let Value::List(results) = results else { panic!("{results:?}") };
    let went_well: Vec<bool> = results
        .iter()
        .map(|one| {
            let Value::List(one) = one else { panic!("{one:?}") };
            matches!(&one[0], Value::List(parts) if parts[0] == Value::Int(1))
        })
        .collect();
    assert_eq!(went_well[..7], [true, true, false, false, true, false, false], "{results:?}");
    let left = value(client.call("get_actors_by_id", 1, |args| {
        args.list(3).uint(cars[0]).uint(cars[1]).uint(sensor);
    }));
    assert_eq!(left, Value::List(Vec::new()));
    drop(client);
    sim.end();
}
