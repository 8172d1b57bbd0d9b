use std::io::Read;

use super::*;

/// The ends of connections: the client's, and the server's in the table.
struct Clients {
    all: Arc<Connections>,
    listener: TcpListener,
    ends: Vec<(TcpStream, Option<Open>)>,
}

impl Clients {
    fn new(room: usize) -> Clients {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        Clients { all: Arc::new(Connections::with_room(room)), listener, ends: Vec::new() }
    }

    fn connect(&mut self, port: &'static str) -> usize {
        let client = TcpStream::connect(self.listener.local_addr().unwrap()).unwrap();
        client.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        let (socket, address) = self.listener.accept().unwrap();
        self.ends.push((client, self.all.add(socket, address, port)));
        self.ends.len() - 1
    }

    fn server(&self, index: usize) -> &Connection {
        &self.ends[index].1.as_ref().unwrap().0
    }

    fn open(&self) -> Vec<u64> {
        self.all.lock().keys().copied().collect()
    }
}

#[test]
fn the_connection_that_has_been_idle_longest_gives_way() {
    let mut clients = Clients::new(3);
    for _ in 0..3 {
        clients.connect("calls");
    }
    // The first has made a call, then the third; the second has never made any.
    clients.server(0).note_use();
    clients.server(2).note_use();
    clients.connect("calls");
    assert_eq!(clients.open(), [1, 3, 4]);
    assert_eq!(clients.ends[1].0.read(&mut [0]).unwrap(), 0, "its client is told");
    clients.server(3).note_use();
    clients.connect("calls");
    assert_eq!(clients.open(), [3, 4, 5]);
    // Other ports have room of their own.
    clients.connect("streams");
    assert_eq!(clients.open(), [3, 4, 5, 6]);
}

#[test]
fn a_connection_in_a_call_does_not_give_way() {
    let mut clients = Clients::new(2);
    for index in [0, 1] {
        clients.connect("calls");
        clients.server(index).begin_call();
    }
    let refused = clients.connect("calls");
    assert!(clients.ends[refused].1.is_none());
    assert_eq!(clients.open(), [1, 2]);
    clients.server(0).end_call();
    clients.connect("calls");
    assert_eq!(clients.open(), [2, 3]);
}

#[test]
fn without_descriptors_the_idlest_connection_of_any_port_gives_way() {
    let mut clients = Clients::new(10);
    clients.connect("streams");
    clients.connect("calls");
    clients.server(0).note_use();
    clients.all.make_room("calls", &io::Error::from_raw_os_error(24));
    assert_eq!(clients.open(), [1]);
    // A client that has gone before it was accepted is no reason.
    clients.all.make_room("calls", &io::ErrorKind::ConnectionAborted.into());
    assert_eq!(clients.open(), [1]);
}

#[test]
fn the_client_with_most_unread_bytes_is_closed_when_all_have_too_many() {
    let mut clients = Clients::new(10);
    for _ in 0..3 {
        clients.connect("calls");
    }
    let third = UNREAD_MAX / 3;
    clients.all.set_unread(clients.server(0), third);
    clients.all.set_unread(clients.server(1), third + 20);
    clients.all.set_unread(clients.server(0), third - 2);
    assert_eq!(clients.all.unread.load(Ordering::Relaxed), 2 * third + 18);
    clients.all.set_unread(clients.server(2), third + 10);
    assert_eq!(clients.ends[1].0.read(&mut [0]).unwrap(), 0, "it has read the least");
    let Clients { all, ends, .. } = clients;
    drop(ends);
    assert_eq!(all.unread.load(Ordering::Relaxed), 0);
}
