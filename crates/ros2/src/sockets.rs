//! The sockets of a participant and the addresses of this machine.

use std::{
    io,
    net::{Ipv4Addr, SocketAddrV4, UdpSocket},
    time::Duration,
};

use socket2::{Domain, Protocol, Socket, Type};

/// The group to which participants announce themselves.
const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);
/// The highest number of a domain.
pub const DOMAIN_MAX: u16 = 232;
/// Participants of one domain on one machine, at most: each has its own port, and those of the
/// highest domain are below 65536.
const PARTICIPANTS_MAX: u16 = 62;
/// How long a receiving thread sleeps before it looks whether it is to end.
const RECEIVE_TIMEOUT: Duration = Duration::from_millis(100);
/// Room for samples that arrive in a burst; the system gives less where its limit is lower.
const BUFFER_BYTES: usize = 4 << 20;

/// The port of the group (OMG RTPS 2.3, section 9.6.1.1).
fn group_port(domain: u16) -> u16 {
    7400 + 250 * domain
}

/// The port of one participant's discovery, on which this program receives data too.
fn unicast_port(domain: u16, participant: u16) -> u16 {
    7410 + 250 * domain + 2 * participant
}

/// The sockets of one participant.
pub(crate) struct Sockets {
    /// Receives what is for this participant, and sends everything except announcements to the
    /// group.
    pub(crate) unicast: UdpSocket,
    /// Receives announcements to the group.
    pub(crate) group: UdpSocket,
    /// One socket for each address of this machine, which sends to the group there.
    announcers: Vec<UdpSocket>,
    /// Addresses of this machine, the loopback address first.
    pub(crate) addresses: Vec<Ipv4Addr>,
    domain: u16,
    port: u16,
}

impl Sockets {
    /// Opens the sockets on the first free port of a domain. Unless `is_network`, nothing that is
    /// sent to the group leaves this machine.
    pub(crate) fn open(domain: u16, is_network: bool) -> io::Result<Sockets> {
        let addresses = local_addresses()?;
        let group = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
        // Every participant of this machine receives on this port.
        group.set_reuse_address(true)?;
        group.bind(&SocketAddrV4::new(GROUP, group_port(domain)).into())?;
        let group = UdpSocket::from(group);
        let mut announcers = Vec::new();
        for address in &addresses {
            // An interface may be without multicast; others are reached by their ports.
            if let Err(e) = group.join_multicast_v4(&GROUP, address) {
                log::debug!("no multicast at {address}: {e}");
                continue;
            }
            let announcer = UdpSocket::bind((*address, 0))?;
            announcer.set_multicast_ttl_v4(is_network.into())?;
            announcers.push(announcer);
        }
        let (unicast, port) = bind_first_free(domain)?;
        for socket in [&unicast, &group] {
            socket.set_read_timeout(Some(RECEIVE_TIMEOUT))?;
        }
        let options = Socket::from(unicast);
        options.set_recv_buffer_size(BUFFER_BYTES)?;
        options.set_send_buffer_size(BUFFER_BYTES)?;
        let unicast = UdpSocket::from(options);
        Ok(Sockets { unicast, group, announcers, addresses, domain, port })
    }

    /// Where others reach this participant. Participants of other machines (`is_network`) must not
    /// take their own loopback address for it.
    pub(crate) fn own_addresses(&self, is_network: bool) -> Vec<SocketAddrV4> {
        let has_others = self.addresses.len() > 1;
        let is_named = |ip: &&Ipv4Addr| !(is_network && has_others && ip.is_loopback());
        let named = self.addresses.iter().filter(is_named);
        named.map(|ip| SocketAddrV4::new(*ip, self.port)).collect()
    }

    /// Sends an announcement to the group, and to the ports of other participants of this machine:
    /// an interface without multicast, as `lo` is, would hide them.
    pub(crate) fn announce(&self, datagram: &[u8]) {
        for announcer in &self.announcers {
            let _ = announcer.send_to(datagram, (GROUP, group_port(self.domain)));
        }
        for participant in 0..PARTICIPANTS_MAX {
            let port = unicast_port(self.domain, participant);
            if port != self.port {
                let _ = self.unicast.send_to(datagram, (Ipv4Addr::LOCALHOST, port));
            }
        }
    }

    /// Returns whether an address is one of this machine.
    pub(crate) fn is_local(&self, address: &Ipv4Addr) -> bool {
        address.is_loopback() || self.addresses.contains(address)
    }
}

fn bind_first_free(domain: u16) -> io::Result<(UdpSocket, u16)> {
    for participant in 0..PARTICIPANTS_MAX {
        let port = unicast_port(domain, participant);
        match UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)) {
            Ok(socket) => return Ok((socket, port)),
            Err(e) if e.kind() == io::ErrorKind::AddrInUse => {}
            Err(e) => return Err(e),
        }
    }
    let (first, last) = (unicast_port(domain, 0), unicast_port(domain, PARTICIPANTS_MAX - 1));
    let why = format!(
        "each of the {PARTICIPANTS_MAX} ports of domain {domain}, {first} to {last}, is in use; \
         use another domain"
    );
    Err(io::Error::new(io::ErrorKind::AddrInUse, why))
}

/// Returns the addresses of this machine from the kernel's routing table, the loopback address
/// first.
fn local_addresses() -> io::Result<Vec<Ipv4Addr>> {
    let table = std::fs::read_to_string("/proc/net/fib_trie")?;
    let others = addresses_of(&table).into_iter().filter(|address| !address.is_loopback());
    Ok(std::iter::once(Ipv4Addr::LOCALHOST).chain(others).collect())
}

/// Returns the addresses that a routing table marks as local, each once.
fn addresses_of(table: &str) -> Vec<Ipv4Addr> {
    let mut addresses = Vec::new();
    let mut last = None;
    for line in table.lines().map(str::trim) {
        if let Some(address) = line.strip_prefix("|-- ") {
            last = address.parse::<Ipv4Addr>().ok();
        } else if line.starts_with("/32 host LOCAL") {
            addresses.extend(last.filter(|address| !addresses.contains(address)));
        }
    }
    addresses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_addresses_of_a_routing_table_are_those_of_hosts() {
        let table = "Main:\n  +-- 0.0.0.0/0 3 0 5\n     |-- 0.0.0.0\n        /0 universe UNICAST\n\
                     \x20    |-- 10.1.2.3\n        /32 host LOCAL\n     |-- 10.1.2.255\n\
                     \x20       /32 link BROADCAST\nLocal:\n     |-- 127.0.0.1\n        /32 host LOCAL\n\
                     \x20    |-- 10.1.2.3\n        /32 host LOCAL\n";
        assert_eq!(addresses_of(table), [Ipv4Addr::new(10, 1, 2, 3), Ipv4Addr::LOCALHOST]);
    }

    #[test]
    fn the_ports_are_those_of_the_standard() {
        assert_eq!((group_port(0), unicast_port(0, 0), unicast_port(1, 2)), (7400, 7410, 7664));
        assert_eq!(unicast_port(DOMAIN_MAX, PARTICIPANTS_MAX - 1), 65532);
    }
}
