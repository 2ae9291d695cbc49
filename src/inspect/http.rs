//! Requests and replies on a connection: HTTP 1.1, one request a connection, no more of it than a
//! page of our own needs.

use std::io::{self, BufRead, Read, Write};

use super::exchange::{Asked, Reply};

/// Most bytes of the head of a request.
const MOST_OF_HEAD: u64 = 16 << 10;
/// Most bytes of what a request sends along.
const MOST_OF_BODY: u64 = 1 << 20;
/// Most lines of a head.
const MOST_HEADERS: usize = 64;
/// What every reply says: nothing is kept, guessed, framed, or told to others.
const HEADERS: &str = "Connection: close\r\n\
    Cache-Control: no-store\r\n\
    X-Content-Type-Options: nosniff\r\n\
    X-Frame-Options: DENY\r\n\
    Referrer-Policy: no-referrer\r\n\
    Cross-Origin-Opener-Policy: same-origin\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n";

/// Reads a request.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] with the reason if it is none that is served; what the connection
/// says.
pub(super) fn read_request(connection: &mut impl BufRead) -> io::Result<Asked> {
    let head = head(connection)?;
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(&head) {
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) => return Err(invalid("the head of the request is cut off")),
        Err(error) => return Err(invalid(&error.to_string())),
    }
    let all = |name: &str| {
        let found = request.headers.iter().filter(|one| one.name.eq_ignore_ascii_case(name));
        found.map(|one| String::from_utf8_lossy(one.value).into_owned()).collect::<Vec<_>>()
    };
    let single = |name: &str| match &all(name)[..] {
        [] => Ok(None),
        [one] => Ok(Some(one.clone())),
        _ => Err(invalid(&format!("the header {name} is given twice"))),
    };
    if single("Transfer-Encoding")?.is_some() {
        return Err(invalid("what a request sends along must have a Content-Length"));
    }
    let length = match single("Content-Length")? {
        None => 0,
        Some(length) => length.parse().map_err(|_| invalid("Content-Length is no number"))?,
    };
    if length > MOST_OF_BODY {
        return Err(invalid("the request sends too much along"));
    }
    let mut asked = Asked {
        is_post: match request.method {
            Some("POST") => true,
            Some("GET") => false,
            _ => return Err(invalid("only GET and POST are served")),
        },
        path: request.path.unwrap_or_default().to_owned(),
        host: single("Host")?,
        origin: single("Origin")?,
        fetch_site: single("Sec-Fetch-Site")?,
        body: vec![0; length as usize],
    };
    connection.read_exact(&mut asked.body)?;
    Ok(asked)
}

/// The head of a request, with the empty line that ends it.
fn head(connection: &mut impl BufRead) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    let mut rest = connection.take(MOST_OF_HEAD);
    loop {
        let line = rest.read_until(b'\n', &mut head)?;
        let is_empty = line == 2 && head.ends_with(b"\r\n");
        if line == 0 || is_empty && head.len() > 2 {
            return Ok(head);
        }
    }
}

fn invalid(problem: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}

/// Writes a reply.
///
/// # Errors
/// What the connection says.
pub(super) fn write_reply(connection: &mut impl Write, reply: &Reply) -> io::Result<()> {
    let Reply { status, content_type, body } = reply;
    let name = match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        409 => "Conflict",
        421 => "Misdirected Request",
        422 => "Unprocessable Content",
        _ => "Internal Server Error",
    };
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status} {name}\r\nContent-Type: {content_type}\r\n\
         Content-Length: {length}\r\n{HEADERS}\r\n"
    );
    connection.write_all(head.as_bytes())?;
    connection.write_all(body)?;
    connection.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(text: &str) -> io::Result<Asked> {
        read_request(&mut text.as_bytes())
    }

    #[test]
    fn a_request_of_a_browser() {
        let text = "POST /t/api/frame HTTP/1.1\r\nhost: a:1\r\nOrigin: http://a:1\r\n\
                    Sec-Fetch-Site: same-origin\r\nContent-Length: 2\r\n\r\n{}rest";
        let expected = Asked {
            is_post: true,
            path: "/t/api/frame".into(),
            host: Some("a:1".into()),
            origin: Some("http://a:1".into()),
            fetch_site: Some("same-origin".into()),
            body: b"{}".to_vec(),
        };
        assert_eq!(asked(text).unwrap(), expected);
        let get = asked("GET / HTTP/1.1\r\n\r\n").unwrap();
        assert!(!get.is_post && get.host.is_none() && get.body.is_empty());
    }

    #[test]
    fn what_is_no_request_of_ours_is_refused() {
        let long = format!("GET / HTTP/1.1\r\nA: {}\r\n\r\n", "x".repeat(20_000));
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(100));
        for text in [
            "",
            "GET",
            "GET / HTTP/1.1\r\n",
            "\0\u{1}\u{2}",
            "DELETE / HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
            "POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\n{}",
            "POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
            "POST / HTTP/1.1\r\nContent-Length: 9999999999\r\n\r\n",
            "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
            &long,
            &many,
        ] {
            assert!(asked(text).is_err(), "{text:.60}");
        }
    }

    #[test]
    fn a_reply_says_how_long_it_is() {
        let reply = Reply { status: 404, content_type: "text/plain", body: b"gone".to_vec() };
        let mut written = Vec::new();
        write_reply(&mut written, &reply).unwrap();
        let text = String::from_utf8(written).unwrap();
        assert!(text.starts_with("HTTP/1.1 404 Not Found\r\nContent-Type: text/plain\r\n"));
        assert!(text.contains("Content-Length: 4\r\n") && text.ends_with("\r\n\r\ngone"));
    }
}
