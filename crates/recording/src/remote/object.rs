//! A remote object: its size, its state, and the bytes of it that are kept.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use object_store::{GetOptions, GetRange, ObjectMeta};
use tokio::runtime::{Builder, Handle};
use tokio::task::AbortHandle;

use super::store::{Place, changed, gives_no_part, is_empty_object, words};
use crate::input::Fetched;

/// Bytes fetched of the end when an object is opened: the summary of a usual recording.
const END: u64 = 256 << 10;
/// Bytes fetched of the start, when something of it is read.
const START: u64 = 64 << 10;
/// Most bytes of an end that are kept.
const MOST_KEPT: u64 = 16 << 20;
/// Most bytes that are kept of the last pieces: a window is looked for first, and then read.
const LAST: usize = 16 << 20;
/// Objects that are kept, so that opening them again takes no request.
const OBJECTS: usize = 8;

/// Shared bytes.
pub(super) type Bytes = Arc<Vec<u8>>;

/// A remote object.
#[derive(Debug)]
pub(super) struct Object {
    address: PathBuf,
    place: Arc<Place>,
    pub(super) size: u64,
    mark: Mark,
    start: Mutex<Option<Bytes>>,
    /// The end, and where it starts.
    end: Mutex<(u64, Bytes)>,
    /// What was taken last, with where each starts.
    last: Mutex<VecDeque<(u64, Bytes)>>,
    /// A number that no other object of this process has.
    pub(super) id: u64,
    requests: AtomicU64,
    bytes: AtomicU64,
}

/// The state of an object, by which a change is noticed.
#[derive(Debug, Clone, PartialEq)]
struct Mark {
    size: u64,
    e_tag: Option<String>,
    modified_ns: Option<i64>,
}

impl Mark {
    fn of(meta: &ObjectMeta) -> Self {
        let modified_ns = meta.last_modified.timestamp_nanos_opt();
        Mark { size: meta.size, e_tag: meta.e_tag.clone(), modified_ns }
    }

    /// The tag that a server is asked to compare. Servers never take a weak one for the same.
    fn strong_tag(&self) -> Option<String> {
        self.e_tag.clone().filter(|tag| !tag.starts_with("W/"))
    }
}

/// A piece of an object that is being fetched; dropping it stops that.
pub(super) struct UnderWay {
    pub(super) range: Range<u64>,
    result: Receiver<io::Result<Vec<u8>>>,
    task: Option<AbortHandle>,
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        if let Some(task) = &self.task {
            task.abort();
        }
    }
}

static NEXT_ID: AtomicU64 = AtomicU64::new(0);

/// The objects that were opened last.
static OPENED: Mutex<Vec<Arc<Object>>> = Mutex::new(Vec::new());

impl Object {
    /// The object at an address; without a request if it was opened before.
    pub(super) fn open(address: &Path) -> io::Result<Arc<Self>> {
        let opened = lock(&OPENED).iter().find(|object| object.address == address).cloned();
        match opened {
            Some(object) => Ok(object),
            None => Self::open_at(address, Place::of(address)?),
        }
    }

    /// Fetches the end of an object, and with it its size and state.
    pub(super) fn open_at(address: &Path, place: Place) -> io::Result<Arc<Self>> {
        let place = Arc::new(place);
        let there = Arc::clone(&place);
        let met = wait(async move { meet(&there).await })?;
        let (size, end) = (met.meta.size, met.end.len() as u64);
        let fetched = end + met.start.as_ref().map_or(0, |start| start.len() as u64);
        // The server sent other bytes than it announced.
        if end != size.min(END) && end != size.min(START) {
            return Err(broken_off());
        }
        let object = Arc::new(Object {
            address: address.to_owned(),
            size,
            mark: Mark::of(&met.meta),
            start: Mutex::new(met.start.map(Arc::new)),
            last: Mutex::default(),
            id: NEXT_ID.fetch_add(1, Relaxed),
            requests: met.requests.into(),
            bytes: fetched.into(),
            end: Mutex::new((size - end, Arc::new(met.end))),
            place,
        });
        let mut opened = lock(&OPENED);
        if opened.len() == OBJECTS {
            opened.remove(0);
        }
        opened.push(Arc::clone(&object));
        Ok(object)
    }

    pub(super) fn fetched(&self) -> Fetched {
        Fetched { requests: self.requests.load(Relaxed), bytes: self.bytes.load(Relaxed) }
    }

    /// Where the end starts that is kept.
    pub(super) fn start_of_end(&self) -> u64 {
        lock(&self.end).0
    }

    /// The bytes kept at a position, and where they start. The start of the object is fetched
    /// first.
    pub(super) fn kept(&self, position: u64) -> io::Result<Option<(u64, Bytes)>> {
        let end = lock(&self.end).clone();
        if position >= end.0 {
            return Ok(Some(end));
        }
        if position >= START.min(end.0) {
            let is_in = |(start, bytes): &&(u64, Bytes)| {
                (*start..start + bytes.len() as u64).contains(&position)
            };
            return Ok(lock(&self.last).iter().find(is_in).cloned());
        }
        let mut start = lock(&self.start);
        let bytes = match &*start {
            Some(bytes) => Arc::clone(bytes),
            None => self.take(self.ask(0..START.min(end.0)))?,
        };
        *start = Some(Arc::clone(&bytes));
        Ok(Some((0, bytes)))
    }

    /// Keeps the end from a position on, unless it is too large.
    pub(super) fn keep_end(&self, from: u64) -> io::Result<()> {
        let mut end = lock(&self.end);
        if from >= end.0 || self.size - from > MOST_KEPT {
            return Ok(());
        }
        let before = self.take(self.ask(from..end.0))?;
        *end = (from, Arc::new([before.as_slice(), end.1.as_slice()].concat()));
        Ok(())
    }

    /// Asks for a piece.
    pub(super) fn ask(&self, range: Range<u64>) -> UnderWay {
        let (sender, result) = sync_channel(1);
        let (place, mark, wanted) = (Arc::clone(&self.place), self.mark.clone(), range.clone());
        self.requests.fetch_add(1, Relaxed);
        // It was started when the object was opened.
        let task = runtime().ok().map(|runtime| {
            runtime.spawn(async move {
                // The piece may have been dropped.
                let _ = sender.send(piece(&place, &mark, wanted).await);
            })
        });
        UnderWay { range, result, task: task.map(|task| task.abort_handle()) }
    }

    /// Waits for a piece.
    pub(super) fn take(&self, piece: UnderWay) -> io::Result<Bytes> {
        let came = piece.result.recv().unwrap_or_else(|_| Err(broken_off()));
        let bytes = came.inspect_err(|_| self.forget())?;
        self.bytes.fetch_add(bytes.len() as u64, Relaxed);
        let bytes = Arc::new(bytes);
        let mut last = lock(&self.last);
        last.push_back((piece.range.start, Arc::clone(&bytes)));
        while last.iter().map(|(_, bytes)| bytes.len()).sum::<usize>() > LAST {
            last.pop_front();
        }
        Ok(bytes)
    }

    /// The next to open the address gets its state then.
    fn forget(&self) {
        lock(&OPENED).retain(|object| !std::ptr::eq(&**object, self));
    }
}

/// What is fetched of an object when it is opened.
struct Met {
    meta: ObjectMeta,
    start: Option<Vec<u8>>,
    end: Vec<u8>,
    requests: u64,
}

/// Fetches the end of an object, and learns what the server says of it on the way.
async fn meet(place: &Place) -> io::Result<Met> {
    let mut requests = 0;
    if place.gives_ends {
        requests += 1;
        match get(place, GetRange::Suffix(END), None).await {
            Ok((meta, end)) => return Ok(Met { meta, start: None, end, requests }),
            Err(error) if gives_no_part(&error) => {}
            Err(error) => return Err(said(place, &error)),
        }
    }
    // Some stores give no end without its start: the size comes with the start of the object.
    let asked = get(place, GetRange::Bounded(0..START), None).await;
    let (meta, start) = asked.map_err(|error| said(place, &error))?;
    requests += 1;
    if meta.size <= START {
        return Ok(Met { meta, start: None, end: start, requests });
    }
    let range = meta.size.saturating_sub(END)..meta.size;
    let asked = get(place, GetRange::Bounded(range), Mark::of(&meta).strong_tag()).await;
    let (again, end) = asked.map_err(|error| said(place, &error))?;
    match Mark::of(&again) == Mark::of(&meta) {
        true => Ok(Met { meta, start: Some(start), end, requests: requests + 1 }),
        false => Err(changed()),
    }
}

/// A part of an object.
async fn get(
    place: &Place,
    range: GetRange,
    if_match: Option<String>,
) -> object_store::Result<(ObjectMeta, Vec<u8>)> {
    let options = GetOptions { range: Some(range), if_match, ..GetOptions::default() };
    let got = place.store.get_opts(&place.key, options).await?;
    let meta = got.meta.clone();
    Ok((meta, got.bytes().await?.into()))
}

fn said(place: &Place, error: &object_store::Error) -> io::Error {
    match is_empty_object(error) {
        true => empty(),
        false => words(place, error),
    }
}

/// A piece of an object that is still as it was.
async fn piece(place: &Place, mark: &Mark, range: Range<u64>) -> io::Result<Vec<u8>> {
    let length = range.end - range.start;
    let asked = get(place, GetRange::Bounded(range), mark.strong_tag()).await;
    let (meta, bytes) = asked.map_err(|error| words(place, &error))?;
    if Mark::of(&meta) != *mark {
        return Err(changed());
    }
    match bytes.len() as u64 == length {
        true => Ok(bytes),
        false => Err(broken_off()),
    }
}

fn broken_off() -> io::Error {
    io::Error::new(ErrorKind::UnexpectedEof, "the connection broke off")
}

fn empty() -> io::Error {
    io::Error::new(ErrorKind::UnexpectedEof, "the object is empty")
}

/// The thread that fetches, started when it is first needed.
fn runtime() -> io::Result<&'static Handle> {
    static RUNTIME: OnceLock<io::Result<Handle>> = OnceLock::new();
    let started = RUNTIME.get_or_init(|| {
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let handle = runtime.handle().clone();
        let run = move || runtime.block_on(std::future::pending::<()>());
        std::thread::Builder::new().name("fetch".to_owned()).spawn(run)?;
        Ok(handle)
    });
    started.as_ref().map_err(|error| io::Error::new(error.kind(), error.to_string()))
}

/// Runs a task in the fetching thread, and waits for it.
fn wait<T: Send + 'static>(
    task: impl Future<Output = io::Result<T>> + Send + 'static,
) -> io::Result<T> {
    let (sender, result) = sync_channel(1);
    runtime()?.spawn(async move {
        // The receiver waits for this.
        let _ = sender.send(task.await);
    });
    result.recv().unwrap_or_else(|_| Err(broken_off()))
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
