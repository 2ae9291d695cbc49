//! The server: sockets on this machine alone.

use std::io::{self, Cursor, Read};
use std::net::{SocketAddr, TcpListener};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;

use tiny_http::{Header, Method, Request, Response};

use super::gate::Gate;
use super::routes::{Asked, Reply, reply};
use super::session::Session;

/// Threads that answer: a page asks for a few things at once, and one of them may be a search for
/// changes that takes seconds.
const THREADS: usize = 6;
/// Most bytes that are read of what a request sends along.
const MOST_BYTES: u64 = 1 << 20;
/// What every reply says: nothing is kept, guessed, framed, or told to others.
const HEADERS: [(&str, &str); 5] = [
    ("Cache-Control", "no-store"),
    ("X-Content-Type-Options", "nosniff"),
    ("X-Frame-Options", "DENY"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
];

/// A server that answers until it is dropped.
pub struct Server {
    gate: Gate,
    http: Arc<tiny_http::Server>,
    threads: Vec<JoinHandle<()>>,
}

impl Server {
    /// Begins to listen. Port 0 is any that is free.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidInput`] if the address is not one of this machine alone; what the
    /// system says if it cannot be listened on.
    pub fn start(session: Arc<Session>, address: SocketAddr) -> io::Result<Self> {
        if !address.ip().is_loopback() {
            let problem = format!("{} is not an address of this machine alone", address.ip());
            return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
        }
        let listener = TcpListener::bind(address)?;
        let gate = Gate::new(listener.local_addr()?)?;
        let http = tiny_http::Server::from_listener(listener, None).map_err(io::Error::other)?;
        let http = Arc::new(http);
        let worker = |_| {
            let (session, gate, http) = (Arc::clone(&session), gate.clone(), Arc::clone(&http));
            std::thread::spawn(move || {
                while let Ok(request) = http.recv() {
                    serve(&session, &gate, request);
                }
            })
        };
        let threads = (0..THREADS).map(worker).collect();
        Ok(Server { gate, http, threads })
    }

    /// The address that opens the page.
    pub fn address(&self) -> String {
        self.gate.address()
    }

    /// Waits until the server ends, which it does by itself only if its sockets fail.
    pub fn wait(mut self) {
        for thread in std::mem::take(&mut self.threads) {
            let _ = thread.join();
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        for _ in 0..self.threads.len() {
            self.http.unblock();
        }
    }
}

/// Answers a request. One whose page has gone is of no interest.
fn serve(session: &Arc<Session>, gate: &Gate, mut request: Request) {
    let Ok(asked) = asked(&mut request) else { return };
    // A panic ends this reply alone, not the thread.
    let answered = catch_unwind(AssertUnwindSafe(|| reply(session, gate, &asked)));
    let _ = request.respond(response(answered.unwrap_or_else(|_| Reply::failed())));
}

fn asked(request: &mut Request) -> io::Result<Asked> {
    let header = |name: &'static str| {
        let found = request.headers().iter().find(|header| header.field.equiv(name));
        found.map(|header| header.value.as_str().to_owned())
    };
    let mut asked = Asked {
        is_post: *request.method() == Method::Post,
        path: request.url().to_owned(),
        host: header("Host"),
        origin: header("Origin"),
        fetch_site: header("Sec-Fetch-Site"),
        body: Vec::new(),
    };
    request.as_reader().take(MOST_BYTES).read_to_end(&mut asked.body)?;
    Ok(asked)
}

fn response(reply: Reply) -> Response<Cursor<Vec<u8>>> {
    let typed = [("Content-Type", reply.content_type)];
    let headers = HEADERS.iter().chain(&typed);
    let response = Response::from_data(reply.body).with_status_code(reply.status);
    headers.fold(response, |response, (name, value)| {
        let header = Header::from_bytes(*name, *value).expect("headers are plain ASCII");
        response.with_header(header)
    })
}
