//! Where a stream goes: a viewer that is running, one that is started, or a file.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::external::re_uri::RedapUri;
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, GrpcSinkConnectionState, LogSink, SinkFlushError};

use crate::error::{Error, Result};
use divmerge_recording::PartialFile;

/// A viewer that is running answers within this time.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// A viewer that is started needs longer.
const SPAWN_TIMEOUT: Duration = Duration::from_secs(20);

/// Connects to a viewer that is running. The error says what is wrong.
pub fn connect(url: &str) -> std::result::Result<GrpcSink, String> {
    connect_within(url, CONNECT_TIMEOUT)
}

/// Starts a viewer, or takes the one that is running on this machine. The error says what is wrong.
pub fn spawn() -> std::result::Result<GrpcSink, String> {
    let options = rerun::SpawnOptions::default();
    let viewer = rerun::spawn(&options).map_err(|error| match error {
        rerun::SpawnError::ExecutableNotFoundInPath { executable_name, .. } => format!(
            "no program `{executable_name}` in PATH; `pip install rerun-sdk==0.36.3` brings one, \
             or use --save"
        ),
        error => error.to_string(),
    })?;
    connect_within(&format!("rerun+http://127.0.0.1:{}/proxy", viewer.port), SPAWN_TIMEOUT)
}

fn connect_within(url: &str, timeout: Duration) -> std::result::Result<GrpcSink, String> {
    let Ok(RedapUri::Proxy(uri)) = url.parse::<RedapUri>() else {
        return Err("not the address of a viewer, as in rerun+http://127.0.0.1:9876/proxy".into());
    };
    let sink = GrpcSink::new(uri);
    let started = Instant::now();
    let problem = loop {
        match sink.status() {
            GrpcSinkConnectionState::Connected => return Ok(sink),
            GrpcSinkConnectionState::Disconnected(Err(error)) => break error.to_string(),
            GrpcSinkConnectionState::Disconnected(Ok(())) => break "disconnected".into(),
            GrpcSinkConnectionState::Connecting { .. } if started.elapsed() > timeout => {
                let seconds = timeout.as_secs();
                break format!("no viewer answered within {seconds} s; is one running?");
            }
            GrpcSinkConnectionState::Connecting { .. } => {
                std::thread::sleep(Duration::from_millis(10));
            }
        }
    };
    // Dropping it would wait for the address once more.
    std::thread::spawn(move || drop(sink));
    Err(problem)
}

/// A `.rrd` that is being written under a temporary name.
pub struct RrdFile {
    writing: Arc<Mutex<Writing>>,
    partial: PartialFile,
}

/// The encoder, or why it failed.
struct Writing(std::result::Result<Encoder<BufWriter<File>>, String>);

/// The end of a stream that writes into the file.
struct RrdSink(Arc<Mutex<Writing>>);

fn lock(writing: &Mutex<Writing>) -> MutexGuard<'_, Writing> {
    writing.lock().unwrap_or_else(PoisonError::into_inner)
}

impl LogSink for RrdSink {
    fn send(&self, message: LogMsg) {
        let Writing(encoder) = &mut *lock(&self.0);
        if let Err(error) = encoder.as_mut().map_or(Ok(0), |encoder| encoder.append(&message)) {
            *encoder = Err(error.to_string());
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> std::result::Result<(), SinkFlushError> {
        match &lock(&self.0).0 {
            Ok(_) => Ok(()),
            Err(problem) => Err(SinkFlushError::failed(problem.clone())),
        }
    }
}

impl RrdFile {
    /// Creates the file under its temporary name.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be created.
    pub fn create(path: &Path, force: bool) -> Result<Self> {
        let (file, partial) = PartialFile::create(path, force)?;
        let file = BufWriter::with_capacity(1 << 20, file);
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let encoder = Encoder::new_eager(CrateVersion::LOCAL, options, file);
        let writing = Writing(encoder.map_err(|error| error.to_string()));
        Ok(RrdFile { writing: Arc::new(Mutex::new(writing)), partial })
    }

    /// Where a stream sends its messages.
    pub fn sink(&self) -> Box<dyn LogSink> {
        Box::new(RrdSink(Arc::clone(&self.writing)))
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// [`Error::Viewer`] for `target` if a message could not be written, [`Error::Io`] if the name
    /// is taken by now.
    pub fn finish(self, target: &str) -> Result<()> {
        let ended = "the stream had ended".to_owned();
        let encoder = std::mem::replace(&mut lock(&self.writing).0, Err(ended));
        let written = encoder.and_then(|mut encoder| {
            encoder.finish().map_err(|error| error.to_string())?;
            let mut file = encoder.into_inner().map_err(|error| error.to_string())?;
            file.flush().map_err(|error| error.to_string())
        });
        written.map_err(|problem| Error::Viewer { target: target.to_owned(), problem })?;
        Ok(self.partial.put()?)
    }
}
