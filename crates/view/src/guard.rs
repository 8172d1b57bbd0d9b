//! Which requests are answered: those of the viewer's own page.
//!
//! A page of another site can send requests to a server on this machine. Two headers, which scripts
//! cannot set, tell them apart: `Origin` names the site of the page (a WebSocket always has it), and
//! `Host` the name that the browser resolved. A site that lets its own name resolve to 127.0.0.1 (DNS
//! rebinding) has that name as both; a numeric address and `localhost` cannot be rebound.

use std::net::IpAddr;

/// Checks the `Host` and `Origin` of a request to a server that listens on `listen`; a request may
/// lack `Origin`, as those of programs do.
///
/// # Errors
///
/// Returns the reason, for people.
pub(crate) fn check(
    listen: IpAddr,
    host: Option<&str>,
    origin: Option<&str>,
) -> Result<(), String> {
    let host = host.ok_or("the request has no Host; use HTTP/1.1")?;
    let name = name_of(host);
    let is_own = match name.parse::<IpAddr>() {
        Ok(address) => address.is_loopback() || !listen.is_loopback(),
        Err(_) => name.eq_ignore_ascii_case("localhost"),
    };
    if !is_own {
        return Err(format!(
            "Host {host:?} is refused: open this page as localhost or by its numeric address"
        ));
    }
    match origin {
        Some(origin) if !origin.eq_ignore_ascii_case(&format!("http://{host}")) => Err(format!(
            "Origin {origin:?} is refused: only the page of http://{host} may use this server"
        )),
        _ => Ok(()),
    }
}

/// Returns a host without its port and without the brackets of an IPv6 address.
fn name_of(host: &str) -> &str {
    match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or(rest),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    #[test]
    fn only_the_own_page_under_a_name_that_cannot_be_rebound_is_served() {
        let (local, all) = (IpAddr::from(Ipv4Addr::LOCALHOST), IpAddr::from(Ipv4Addr::UNSPECIFIED));
        let cases = [
            (local, Some("127.0.0.1:7878"), None, true),
            (local, Some("localhost"), Some("http://localhost"), true),
            (local, Some("LocalHost:9000"), Some("http://localhost:9000"), true),
            (local, Some("[::1]:7878"), Some("http://[::1]:7878"), true),
            (local, None, None, false),
            (local, Some("evil.example:7878"), None, false),
            (local, Some("localhost.evil.example"), None, false),
            (local, Some("127.0.0.1.evil.example:7878"), None, false),
            (local, Some("192.168.0.7:7878"), None, false),
            (local, Some("evil.example"), Some("http://evil.example"), false),
            (local, Some("localhost:7878"), Some("http://evil.example"), false),
            (local, Some("localhost:7878"), Some("http://localhost:3000"), false),
            (local, Some("localhost:7878"), Some("https://localhost:7878"), false),
            (local, Some("localhost:7878"), Some("null"), false),
            (all, Some("192.168.0.7:7878"), Some("http://192.168.0.7:7878"), true),
            (all, Some("workstation:7878"), None, false),
        ];
        for (listen, host, origin, is_served) in cases {
            let checked = check(listen, host, origin);
            assert_eq!(checked.is_ok(), is_served, "{listen} {host:?} {origin:?}: {checked:?}");
        }
    }
}
