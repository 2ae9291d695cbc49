//! Writes a ROS 2 recording of any length to standard output: a simulated drive of a few frames,
//! over and over.
//!
//! ```sh
//! cargo run --release --example 11_long_recording -- 2000 > long.mcap         # 2,000 MB
//! ```
//!
//! For measurements that want more than a disk holds; memory does not grow with the length but for
//! the index that the format keeps. The clouds of a turn of [`FRAMES`] differ, and no two messages
//! have the same time.

use std::io::{self, BufWriter};

use divmerge::datasets::drive::{CLOUD_TOPIC, cloud_message};
use divmerge::messages::definitions::POINT_CLOUD2;
use divmerge::simulate::{Drive, Scene, Sensor};
use mcap::records::MessageHeader;
use mcap::write::NoSeek;

/// Frames that are simulated.
const FRAMES: usize = 10;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let usage = "usage: 11_long_recording MEGABYTES [--uncompressed] > OUT";
    let megabytes: u64 = std::env::args().nth(1).ok_or(usage)?.parse().map_err(|_| usage)?;
    let compression = match std::env::args().nth(2).as_deref() {
        Some("--uncompressed") => None,
        None => Some(mcap::Compression::Zstd),
        Some(_) => return Err(usage.into()),
    };
    let drive = Drive::new(Sensor::Hdl64e, Scene::Street, 1);
    let clouds: Vec<Vec<u8>> = (0..FRAMES)
        .map(|number| {
            let mut message = Vec::new();
            cloud_message(&drive.frame(number), &mut message).map(|()| message)
        })
        .collect::<Result<_, _>>()?;
    let options = mcap::WriteOptions::new()
        .profile("ros2")
        .compression(compression)
        .chunk_size(Some(4 << 20))
        .disable_seeking(true);
    let mut counted = Counted { to: BufWriter::new(io::stdout().lock()), bytes: 0 };
    let mut writer = options.create(NoSeek::new(&mut counted))?;
    let schema = writer.add_schema(POINT_CLOUD2.name, "ros2msg", &POINT_CLOUD2.data)?;
    let channel_id = writer.add_channel(schema, CLOUD_TOPIC, "cdr", &Default::default())?;
    // Bytes of messages stand for those of the file where that is not compressed.
    let mut bytes = 0;
    for (sequence, cloud) in (0..).zip(clouds.iter().cycle()) {
        let time = 1_700_000_000_000_000_000 + u64::from(sequence) * 100_000_000;
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, cloud)?;
        bytes += cloud.len() as u64;
        if bytes >= megabytes * 1_000_000 {
            break;
        }
    }
    writer.finish()?;
    drop(writer);
    eprintln!("{} bytes", counted.bytes);
    Ok(())
}

/// Counts what passes.
struct Counted<W> {
    to: W,
    bytes: u64,
}

impl<W: io::Write> io::Write for Counted<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.to.write(bytes)?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}
