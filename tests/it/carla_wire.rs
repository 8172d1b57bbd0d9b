//! CARLA's protocol as the scenarios speak it: connections that call, and listeners to streams.

use std::{
    io::{Read, Write},
    net::TcpStream,
    time::Duration,
};

use carla_gateway::msgpack::{Budget, Pack, Value, read};

/// A read that lasts longer fails the test instead of blocking it.
pub(crate) const READ_TIMEOUT: Duration = Duration::from_secs(60);

/// A connection that calls.
pub(crate) struct Connection {
    stream: TcpStream,
    port: u16,
}

impl Connection {
    pub(crate) fn open(port: u16) -> Connection {
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(READ_TIMEOUT)).unwrap();
        Connection { stream, port }
    }

    /// Returns the port to which this is a connection.
    pub(crate) fn port(&self) -> u16 {
        self.port
    }

    /// Sends a call and returns its result. `write` writes the arguments.
    pub(crate) fn call(
        &mut self,
        method: &str,
        args: usize,
        write: impl FnOnce(&mut Pack),
    ) -> Value {
        self.send(method, args, write);
        self.answer(method)
    }

    /// Sends a call that the server refuses, and returns the text of the error.
    pub(crate) fn refusal(
        &mut self,
        method: &str,
        args: usize,
        write: impl FnOnce(&mut Pack),
    ) -> String {
        self.send(method, args, write);
        let [error, result] = self.error_and_result(method);
        if let Value::Text(why) = error {
            return why;
        }
        // An error is the last value of both wrappers: `[[0, [text]]]` and `[[true, [text]]]`.
        let inner = |value: &Value| match value {
            Value::List(values) => values.last().cloned(),
            _ => None,
        };
        let error = inner(&result).as_ref().and_then(inner).as_ref().and_then(inner);
        let Some(Value::Text(why)) = error else { panic!("{method} is accepted: {result:?}") };
        why
    }

    /// Sends a call whose answer is not read yet.
    pub(crate) fn send(&mut self, method: &str, args: usize, write: impl FnOnce(&mut Pack)) {
        let mut request = Pack::new();
        request.list(4).uint(0).uint(1).text(method).list(1 + args).list(1).bool(false);
        write(&mut request);
        self.stream.write_all(request.bytes()).unwrap();
    }

    /// Reads the answer to the oldest call that has none.
    pub(crate) fn answer(&mut self, method: &str) -> Value {
        let [error, result] = self.error_and_result(method);
        assert_eq!(error, Value::Nil, "{method}");
        result
    }

    fn error_and_result(&mut self, method: &str) -> [Value; 2] {
        let answer = read(&mut self.stream, &mut Budget::new(1 << 20, 1 << 24));
        let Value::List(parts) = answer.unwrap_or_else(|e| panic!("{method}: {e}")) else {
            panic!("{method}: the answer is not a list")
        };
        let [_, _, error, result] =
            <[Value; 4]>::try_from(parts).unwrap_or_else(|parts| panic!("{method}: {parts:?}"));
        [error, result]
    }

    pub(crate) fn set_synchronous(&mut self) {
        self.call("set_episode_settings", 1, |settings| {
            settings.list(11).bool(true).bool(false).list(2).bool(true).f64(0.05);
            settings.bool(true).f64(0.01).int(10).f32(0.0).bool(true);
            settings.f32(3000.0).f32(2000.0).bool(true);
        });
    }

    /// Advances the world and returns the new frame.
    pub(crate) fn tick(&mut self) -> u64 {
        match value(self.call("tick_cue", 0, |_| {})) {
            Value::Int(frame) => frame as u64,
            other => panic!("{other:?}"),
        }
    }

    /// Spawns an actor at a place in CARLA's axes, with attributes of type string, and returns its
    /// id.
    pub(crate) fn spawn(
        &mut self,
        blueprint: &str,
        attributes: &[(&str, &str)],
        at_m: [f32; 3],
    ) -> u64 {
        let actor = value(self.call("spawn_actor", 2, |args| {
            args.list(3).uint(0).text(blueprint).list(attributes.len());
            for (name, value) in attributes {
                args.list(3).text(name).uint(4).text(value);
            }
            args.list(2).vector(at_m).vector([0.0; 3]);
        }));
        let Value::List(fields) = actor else { panic!("{blueprint}: {actor:?}") };
        match fields[0] {
            Value::Int(id) => id as u64,
            ref other => panic!("{blueprint}: {other:?}"),
        }
    }

    /// Spawns a camera of this size and returns its id and the number of its stream.
    pub(crate) fn spawn_camera(&mut self, [width, height]: [u32; 2]) -> (u64, u32) {
        let (width, height) = (width.to_string(), height.to_string());
        let size = [("image_size_x", &*width), ("image_size_y", &*height)];
        let id = self.spawn("sensor.camera.rgb", &size, [0.0, 0.0, 30.0]);
        let asked = value(self.call("get_actors_by_id", 1, |args| {
            args.list(1).uint(id);
        }));
        let Value::List(actors) = asked else { panic!("{asked:?}") };
        let Value::List(fields) = &actors[0] else { panic!("{actors:?}") };
        let Value::Bytes(token) = &fields[5] else { panic!("{fields:?}") };
        (id, u32::from_le_bytes(token[..4].try_into().unwrap()))
    }

    /// Calls that lock the bridge: they read the world, or queue a command.
    pub(crate) fn call_each_kind(&mut self) {
        self.call("get_episode_info", 0, |_| {});
        self.call("get_episode_settings", 0, |_| {});
        self.call("get_weather_parameters", 0, |_| {});
        self.call("get_vehicle_light_states", 0, |_| {});
        self.call("get_actors_by_id", 1, |args| {
            args.list(1).uint(1);
        });
        self.call("freeze_all_traffic_lights", 1, |args| {
            args.bool(false);
        });
        self.call("version", 0, |_| {});
    }

    /// Returns the port of the traffic manager.
    pub(crate) fn traffic_manager_port(&mut self) -> u16 {
        let address = value(self.call("get_traffic_manager_running", 0, |_| {}));
        let Value::List(address) = address else { panic!("{address:?}") };
        let Value::Int(port) = address[1] else { panic!("{address:?}") };
        port as u16
    }

    /// Returns the port of streams, which is part of the world's token.
    pub(crate) fn stream_port(&mut self) -> u16 {
        let Value::List(info) = value(self.call("get_episode_info", 0, |_| {})) else { panic!() };
        let Value::List(token) = &info[1] else { panic!("{info:?}") };
        let Value::Bytes(token) = &token[0] else { panic!("{token:?}") };
        u16::from_le_bytes(token[4..6].try_into().unwrap())
    }

    /// Calls of the traffic manager: the check of the official client whether it is there, which
    /// must be answered within two seconds, and a parameter.
    pub(crate) fn call_traffic_manager(&mut self) {
        let port = self.traffic_manager_port();
        let mut manager = TcpStream::connect(("127.0.0.1", port)).unwrap();
        manager.set_read_timeout(Some(READ_TIMEOUT)).unwrap();
        let mut ask = |method: &str, args: usize, write: fn(&mut Pack)| {
            let mut request = Pack::new();
            request.list(4).uint(0).uint(1).text(method).list(args);
            write(&mut request);
            manager.write_all(request.bytes()).unwrap();
            let answer = read(&mut manager, &mut Budget::new(1 << 10, 1 << 10));
            answer.unwrap_or_else(|e| panic!("{method}: {e}"));
        };
        ask("health_check_remote_TM", 0, |_| {});
        ask("set_global_percentage_speed_difference", 1, |args| {
            args.f32(10.0);
        });
    }
}

/// Returns the value of an answer `[[1, value]]`.
pub(crate) fn value(answer: Value) -> Value {
    let Value::List(mut wrapped) = answer else { panic!("{answer:?}") };
    match wrapped.pop() {
        Some(Value::List(mut parts)) if parts.first() == Some(&Value::Int(1)) => {
            parts.pop().unwrap()
        }
        other => panic!("{other:?}"),
    }
}

/// A listener to a stream.
pub(crate) struct Listener(TcpStream);

/// A message of a stream.
pub(crate) struct Message {
    pub(crate) frame: u64,
    pub(crate) bytes: usize,
}

impl Listener {
    /// Requests a stream and connects to it.
    pub(crate) fn open(connection: &mut Connection, stream: u32) -> Listener {
        connection.call("get_sensor_token", 1, |args| {
            args.uint(stream.into());
        });
        // On a connection of its own, since the answers of this one may wait unread.
        let port = Connection::open(connection.port).stream_port();
        let mut socket = TcpStream::connect(("127.0.0.1", port)).unwrap();
        socket.set_read_timeout(Some(READ_TIMEOUT)).unwrap();
        socket.write_all(&stream.to_le_bytes()).unwrap();
        Listener(socket)
    }

    /// Receives the next message.
    pub(crate) fn next(&mut self) -> Message {
        let mut len = [0; 4];
        self.0.read_exact(&mut len).unwrap();
        let mut bytes = vec![0; u32::from_le_bytes(len) as usize];
        self.0.read_exact(&mut bytes).unwrap();
        let frame = u64::from_le_bytes(bytes[8..16].try_into().unwrap());
        Message { frame, bytes: bytes.len() }
    }
}
