//! Who may ask: a page that knows the token in the address, of this very server.
//!
//! The server listens on this machine alone, but any page in the user's browser can send requests
//! to it, and any user of the machine can. So the path begins with a random token; `Host` must be
//! the server's own, so that no other name leads here (DNS rebinding); and `Origin` and
//! `Sec-Fetch-Site`, where a browser sends them, must be those of the page itself.

use std::net::SocketAddr;

use super::exchange::Asked;

/// Bytes of a token.
const TOKEN_BYTES: usize = 16;

/// The server's address and its secret.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gate {
    token: String,
    hosts: Vec<String>,
}

/// Whether a request may pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access<'a> {
    /// It may; this is its path behind the token.
    Granted(&'a str),
    /// It may not, with the status of the reply and the reason.
    Refused(u16, &'static str),
}

impl Gate {
    /// A gate with a new token at an address of this machine.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub fn new(address: SocketAddr) -> std::io::Result<Self> {
        let mut bytes = [0_u8; TOKEN_BYTES];
        getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
        let token = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Gate::with_token(address, token))
    }

    /// A gate with a token that is known.
    pub(super) fn with_token(address: SocketAddr, token: String) -> Self {
        let hosts = vec![address.to_string(), format!("localhost:{}", address.port())];
        Gate { token, hosts }
    }

    /// The address that opens the page.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.hosts[0], self.token)
    }

    /// Whether a request may pass.
    pub fn access<'a>(&self, asked: &'a Asked) -> Access<'a> {
        let is_ours = |host: &str| self.hosts.iter().any(|own| own.eq_ignore_ascii_case(host));
        if !asked.host.as_deref().is_some_and(is_ours) {
            return Access::Refused(421, "this is not the host that was asked for");
        }
        let is_own_page = |origin: &str| origin.strip_prefix("http://").is_some_and(is_ours);
        if asked.origin.as_deref().is_some_and(|origin| !is_own_page(origin)) {
            return Access::Refused(403, "only the page of the inspector itself may ask");
        }
        let is_own_site = |site: &str| matches!(site, "same-origin" | "none");
        if asked.fetch_site.as_deref().is_some_and(|site| !is_own_site(site)) {
            return Access::Refused(403, "only the page of the inspector itself may ask");
        }
        let path = asked.path.split('?').next().unwrap_or_default();
        let rest = path.strip_prefix('/').and_then(|path| path.split_once('/'));
        match rest {
            Some((token, rest)) if is_same(token.as_bytes(), self.token.as_bytes()) => {
                Access::Granted(rest)
            }
            _ => Access::Refused(
                404,
                "nothing is here: open the address that `divmerge inspect` printed",
            ),
        }
    }
}

/// Whether two texts are the same, in a time that does not tell where they differ.
fn is_same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(path: &str, host: &str) -> Asked {
        Asked { path: path.into(), host: Some(host.into()), ..Asked::default() }
    }

    fn gate() -> Gate {
        Gate::with_token("127.0.0.1:4711".parse().unwrap(), "secret".into())
    }

    #[test]
    fn the_token_opens_and_nothing_else_does() {
        let gate = gate();
        let access =
            |path: &str| gate.access(&asked(path, "127.0.0.1:4711")) == Access::Granted("");
        assert_eq!(gate.address(), "http://127.0.0.1:4711/secret/");
        assert!(access("/secret/") && access("/secret/?x"));
        for path in ["/", "/secret", "//secret/", "/Secret/", "/secre/", "/secrets/", "secret/", ""]
        {
            assert!(!access(path), "{path}");
        }
        let deep = asked("/secret/api/frame", "localhost:4711");
        assert_eq!(gate.access(&deep), Access::Granted("api/frame"));
    }

    #[test]
    fn no_other_host_and_no_other_page() {
        let gate = gate();
        for host in ["evil.example:4711", "127.0.0.1", "127.0.0.1:80", "127.0.0.2:4711", ""] {
            assert!(
                matches!(gate.access(&asked("/secret/", host)), Access::Refused(421, _)),
                "{host}"
            );
        }
        let nobody = Asked { path: "/secret/".into(), ..Asked::default() };
        assert!(matches!(gate.access(&nobody), Access::Refused(421, _)));
        let from = |origin: &str| Asked {
            origin: Some(origin.into()),
            ..asked("/secret/", "127.0.0.1:4711")
        };
        assert_eq!(gate.access(&from("http://127.0.0.1:4711")), Access::Granted(""));
        for origin in ["null", "http://evil.example", "https://127.0.0.1:4711", "127.0.0.1:4711"] {
            assert!(matches!(gate.access(&from(origin)), Access::Refused(403, _)), "{origin}");
        }
        let site = |site: &str| Asked {
            fetch_site: Some(site.into()),
            ..asked("/secret/", "127.0.0.1:4711")
        };
        assert_eq!(gate.access(&site("none")), Access::Granted(""));
        assert!(matches!(gate.access(&site("cross-site")), Access::Refused(403, _)));
        assert!(matches!(gate.access(&site("same-site")), Access::Refused(403, _)));
    }

    #[test]
    fn tokens_are_long_and_differ() {
        let address = "127.0.0.1:1".parse().unwrap();
        let [a, b] = [0, 1].map(|_| Gate::new(address).unwrap());
        assert_eq!(a.token.len(), 2 * TOKEN_BYTES);
        assert_ne!(a.token, b.token);
    }
}
