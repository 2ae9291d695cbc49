//! What a path can name besides a file: a stream, or an address in an object store or on a web
//! server.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The name that stands for the standard streams: input to be read from, output to be written to.
pub const STANDARD_STREAM: &str = "-";

/// What stands between an address's scheme and the rest.
const BEHIND_SCHEME: &str = "://";

/// Whole addresses by the names that stand for them.
static WHOLE: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());

/// Whether a path names a stream, which can be read once from front to back: standard input, a
/// pipe, a device.
pub fn is_stream(path: &Path) -> bool {
    let is_other = |metadata: std::fs::Metadata| !metadata.is_file() && !metadata.is_dir();
    path == STANDARD_STREAM || !is_remote(path) && path.metadata().is_ok_and(is_other)
}

/// Whether a path is an address, such as `s3://bucket/drive.mcap`, and not the name of a file.
/// Write `./` before the name of such a file.
pub fn is_remote(path: &Path) -> bool {
    path.to_str().is_some_and(|text| scheme(text).is_some())
}

/// The part of an address before `://`; `None` if the text is no address.
pub(crate) fn scheme(text: &str) -> Option<&str> {
    let (scheme, _) = text.split_once(BEHIND_SCHEME)?;
    let is_scheme = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    is_scheme.then_some(scheme)
}

/// Hides the secrets of an http(s) address: its query, which can grant access, and the user's name
/// and password. The name that is returned stands for the whole address in this process and may be
/// shown and written; to open it, the whole address is sent. Other texts are returned as they are.
///
/// Readers refuse an address with secrets, since it could get into messages and outputs.
pub fn put_secrets_aside(address: &str) -> PathBuf {
    let open = open_part(address);
    if open == address {
        return PathBuf::from(address);
    }
    let mut whole = aside();
    // Addresses that differ in their secrets only may be different objects.
    let mut names = (1_u64..).map(|number| match number {
        1 => open.clone(),
        number => format!("{open}#{number}"),
    });
    let is_free = |name: &String| whole.get(name).is_none_or(|taken| taken == address);
    let name = names.find(is_free).unwrap_or(open);
    whole.insert(name.clone(), address.to_owned());
    PathBuf::from(name)
}

/// The whole address that a name stands for.
#[cfg(any(test, feature = "remote"))]
pub(crate) fn whole(name: &str) -> String {
    aside().get(name).cloned().unwrap_or_else(|| name.to_owned())
}

/// An address without its secrets.
pub(crate) fn open_part(address: &str) -> String {
    let Some(scheme) = scheme(address).filter(|scheme| is_http(scheme)) else {
        return address.to_owned();
    };
    let rest = &address[scheme.len() + BEHIND_SCHEME.len()..];
    let rest = rest.split(['?', '#']).next().unwrap_or_default();
    let (host, path) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
    let host = host.rsplit('@').next().unwrap_or_default();
    format!("{scheme}{BEHIND_SCHEME}{host}{path}")
}

/// Whether a scheme is that of a web server.
pub(crate) fn is_http(scheme: &str) -> bool {
    ["http", "https"].iter().any(|known| scheme.eq_ignore_ascii_case(known))
}

fn aside() -> MutexGuard<'static, BTreeMap<String, String>> {
    WHOLE.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_an_address() {
        for address in
            ["s3://b/k", "gs://b/a/k.mcap", "az://c/k", "https://h/k", "HTTP://h/k", "foo://x"]
        {
            assert!(is_remote(Path::new(address)), "{address}");
        }
        for file in
            ["a.mcap", "./s3://b/k", "-", "", "/a/b://c", "a b://c", "://x", "1a://x", "s3:/b/k"]
        {
            assert!(!is_remote(Path::new(file)), "{file}");
        }
    }

    #[test]
    fn secrets_are_put_aside() {
        let open = |address: &str| open_part(address);
        assert_eq!(open("https://u:p@h:1/a/b.mcap?X-Sig=a/b&c=d#e"), "https://h:1/a/b.mcap");
        assert_eq!(open("https://h?q=/@x"), "https://h");
        assert_eq!(open("https://h/a@b.mcap"), "https://h/a@b.mcap");
        // In a store these belong to the name.
        for name in ["s3://b/a?b#c.mcap", "abfss://container@account.dfs.core.windows.net/k", "a?b"]
        {
            assert_eq!((open(name), put_secrets_aside(name)), (name.to_owned(), name.into()));
        }

        let [first, second] = ["https://h/get?id=1", "https://h/get?id=2"];
        let names = [first, second, first].map(put_secrets_aside);
        assert_eq!(names[0], names[2]);
        assert_eq!(names[0], Path::new("https://h/get"));
        assert_eq!(names[1], Path::new("https://h/get#2"));
        assert_eq!(whole("https://h/get"), first);
        assert_eq!(whole("https://h/get#2"), second);
        assert_eq!(whole("https://h/other"), "https://h/other");
    }
}
