//! Which requests are answered: those of the viewer's own page.
//!
//! A page of another site can send requests to a server on this machine. Two headers, which scripts
//! cannot set, tell them apart: `Origin` names the site of the page (a WebSocket always has it), and
//! `Host` the name that the browser resolved. A site that lets its own name resolve to 127.0.0.1 (DNS
//! rebinding) has that name as both; a numeric address and `localhost` cannot be rebound.
//!
//! The Foxglove WebSocket only reads. It also answers Foxglove's own site, desktop programs, whose pages
//! are files, and sites that this machine serves, as a Lichtblick in a container.

use std::net::IpAddr;

/// Which pages may use an address, beside programs, which have no `Origin`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pages {
    /// The viewer's own.
    Own,
    /// Also those of Foxglove and Lichtblick.
    Foxglove,
}

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
    pages: Pages,
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
        None => Ok(()),
        Some(origin) if origin.eq_ignore_ascii_case(&format!("http://{host}")) => Ok(()),
        Some(origin) if pages == Pages::Foxglove && is_foxglove(origin) => Ok(()),
        Some(origin) => Err(format!(
            "Origin {origin:?} is refused: only the page of http://{host} may use this server"
        )),
    }
}

/// Whether Foxglove or Lichtblick may have this origin.
fn is_foxglove(origin: &str) -> bool {
    let origin = origin.to_ascii_lowercase();
    let Some((scheme, host)) = origin.split_once("://") else { return false };
    let name = name_of(host);
    let is_loopback = name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback());
    match scheme {
        "file" => true,
        "http" | "https" if name == "localhost" || is_loopback => true,
        "https" => name == "foxglove.dev" || name.ends_with(".foxglove.dev"),
        _ => false,
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
            let checked = check(listen, host, origin, Pages::Own);
            assert_eq!(checked.is_ok(), is_served, "{listen} {host:?} {origin:?}: {checked:?}");
        }
    }

    #[test]
    fn foxglove_s_own_pages_may_use_its_address_and_other_sites_may_not() {
        let local = IpAddr::from(Ipv4Addr::LOCALHOST);
        for (origin, is_served) in [
            ("https://app.foxglove.dev", true),
            ("file://", true),
            ("http://localhost:8080", true),
            ("http://127.0.0.1:8080", true),
            ("http://[::1]:8080", true),
            ("http://app.foxglove.dev", false),
            ("https://foxglove.dev.evil.example", false),
            ("https://evilfoxglove.dev", false),
            ("http://localhost.evil.example", false),
            ("https://evil.example", false),
            ("null", false),
        ] {
            let checked = check(local, Some("localhost:7878"), Some(origin), Pages::Foxglove);
            assert_eq!(checked.is_ok(), is_served, "{origin}");
            assert!(check(local, Some("localhost:7878"), Some(origin), Pages::Own).is_err());
        }
        let rebound = check(local, Some("evil.example:7878"), Some("file://"), Pages::Foxglove);
        assert!(rebound.is_err());
    }
}
