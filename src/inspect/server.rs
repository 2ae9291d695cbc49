//! The server: sockets on this machine alone.

use std::io::{self, BufReader, ErrorKind};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use super::exchange::{Asked, Reply};
use super::gate::Gate;
use super::http::{read_request, write_reply};
use super::routes::reply;
use super::session::Session;

/// Connections at a time; a browser has six.
const MOST_CONNECTIONS: usize = 32;
/// How long a connection may take to say what it wants, or to take what it is given.
const PATIENCE: Duration = Duration::from_secs(20);

/// A server that answers until it is dropped.
pub struct Server {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    address: SocketAddr,
}

/// What the threads of a server share.
struct Shared {
    session: Arc<Session>,
    gate: Gate,
    connections: AtomicUsize,
    is_over: AtomicBool,
}

impl Server {
    /// Begins to listen. Port 0 is any that is free.
    ///
    /// # Errors
    /// [`ErrorKind::InvalidInput`] if the address is not one of this machine alone; what the system
    /// says if it cannot be listened on.
    pub fn start(session: Arc<Session>, address: SocketAddr) -> io::Result<Self> {
        if !address.ip().is_loopback() {
            let problem = format!("{} is not an address of this machine alone", address.ip());
            return Err(io::Error::new(ErrorKind::InvalidInput, problem));
        }
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared {
            session,
            gate: Gate::new(address)?,
            connections: AtomicUsize::new(0),
            is_over: AtomicBool::new(false),
        });
        let own = Arc::clone(&shared);
        let thread = std::thread::spawn(move || listen(&listener, &own));
        Ok(Server { shared, thread: Some(thread), address })
    }

    /// The address that opens the page.
    pub fn address(&self) -> String {
        self.shared.gate.address()
    }

    /// Waits until the server ends, which it does by itself only if its socket fails.
    pub fn wait(mut self) {
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::SeqCst);
        // The listening thread looks up at the next connection.
        let _ = TcpStream::connect(self.address);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Takes connections, each into a thread of its own.
fn listen(listener: &TcpListener, shared: &Arc<Shared>) {
    for connection in listener.incoming() {
        if shared.is_over.load(Ordering::SeqCst) {
            return;
        }
        let Ok(connection) = connection else { continue };
        if shared.connections.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
            shared.connections.fetch_sub(1, Ordering::SeqCst);
            continue;
        }
        let shared = Arc::clone(shared);
        std::thread::spawn(move || {
            // A page that has gone is of no interest.
            let _ = serve(&shared, &connection);
            shared.connections.fetch_sub(1, Ordering::SeqCst);
        });
    }
}

/// Answers the request of a connection.
fn serve(shared: &Shared, mut connection: &TcpStream) -> io::Result<()> {
    connection.set_read_timeout(Some(PATIENCE))?;
    connection.set_write_timeout(Some(PATIENCE))?;
    connection.set_nodelay(true)?;
    let reply = match read_request(&mut BufReader::new(connection)) {
        Ok(asked) => answered(shared, &asked),
        Err(error) if error.kind() == ErrorKind::InvalidData => {
            Reply::problem(400, &error.to_string())
        }
        Err(error) => return Err(error),
    };
    write_reply(&mut connection, &reply)
}

/// The answer; a panic ends this one alone.
fn answered(shared: &Shared, asked: &Asked) -> Reply {
    let answered = catch_unwind(AssertUnwindSafe(|| reply(&shared.session, &shared.gate, asked)));
    answered.unwrap_or_else(|_| {
        Reply::problem(500, "this is a fault of divmerge: see what it printed in the terminal")
    })
}
