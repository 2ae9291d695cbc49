use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use object_store::memory::InMemory;
use object_store::path::Path as Key;
use object_store::{ObjectStore, ObjectStoreExt};

use super::object::Object;
use super::store::Place;
use super::{FIRST, PIECE, RemoteFile, SMALL_GAP};
use crate::input::Input;

/// More than several pieces.
const SIZE: usize = 5 * PIECE as usize + 12_345;
/// The end and the start, which are fetched in any case.
const ENDS: u64 = (256 << 10) + (64 << 10);

fn bytes(size: usize) -> Vec<u8> {
    (0..size).map(|at| (at ^ (at >> 8) ^ (at >> 16)) as u8).collect()
}

/// A store that others can write to.
#[derive(Clone)]
struct Store(Arc<InMemory>);

impl Store {
    fn with(bytes: Vec<u8>) -> Self {
        let store = Store(Arc::default());
        store.put(bytes);
        store
    }

    fn put(&self, bytes: Vec<u8>) {
        let put = async { self.0.put(&Key::from("key"), bytes.into()).await };
        tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(put).unwrap();
    }

    fn open(&self, address: &str, gives_ends: bool) -> std::io::Result<Arc<Object>> {
        let store: Box<dyn ObjectStore> = Box::new(Arc::clone(&self.0));
        let place = Place { store, key: Key::from("key"), gives_ends, credentials: "" };
        Object::open_at(Path::new(address), place)
    }
}

fn read(file: &mut RemoteFile, start: usize, length: usize) -> Vec<u8> {
    let mut found = vec![0; length];
    file.seek(SeekFrom::Start(start as u64)).unwrap();
    let read = file.read(&mut found).unwrap();
    found.truncate(read);
    found
}

#[test]
fn read_through_in_large_pieces() {
    let all = bytes(SIZE);
    for gives_ends in [true, false] {
        let object = Store::with(all.clone()).open("test://through", gives_ends).unwrap();
        assert_eq!(object.fetched().requests, if gives_ends { 1 } else { 2 });
        let mut file = RemoteFile::of(object);
        let mut found = Vec::new();
        file.read_to_end(&mut found).unwrap();
        assert!(found == all);
        // The end, the start, 1 MiB, 4, four times 8, and what is left.
        assert_eq!(file.fetched().unwrap().requests, 9);
        assert_eq!(file.fetched().unwrap().bytes, SIZE as u64);
    }
}

#[test]
fn any_place_in_any_order() {
    let all = bytes(SIZE);
    let mut file = RemoteFile::of(Store::with(all.clone()).open("test://any", true).unwrap());
    let piece = PIECE as usize;
    let places = [
        0,
        70_000,
        SIZE - 10,
        3 * piece,
        3 * piece + 5,
        piece,
        65_536,
        65_535,
        SIZE - 300_000,
        SIZE,
    ];
    for start in places {
        for length in [1, 100_000, 3_000_000] {
            let end = SIZE.min(start + length);
            assert!(read(&mut file, start, length) == all[start..end], "{start} {length}");
        }
    }
    assert_eq!(file.seek(SeekFrom::End(-5)).unwrap(), SIZE as u64 - 5);
    assert!(file.seek(SeekFrom::Current(-(SIZE as i64))).is_err());
}

#[test]
fn of_stretches_no_more_than_small_gaps() {
    let all = bytes(SIZE);
    let mut file = RemoteFile::of(Store::with(all.clone()).open("test://stretches", true).unwrap());
    let stretches = [3 << 20..4 << 20, 20 << 20..22 << 20, 22 << 20..23 << 20, 30 << 20..31 << 20];
    file.expect(stretches.to_vec());
    for stretch in &stretches {
        let (start, length) = (stretch.start as usize, (stretch.end - stretch.start) as usize);
        assert!(read(&mut file, start, length) == all[start..start + length]);
    }
    // Two of them are one, and the start was not needed.
    assert_eq!(
        (file.fetched().unwrap().requests, file.fetched().unwrap().bytes),
        (1 + 3, (256 << 10) + (5 << 20))
    );

    let small = 9 << 20..10 << 20;
    let near = small.end + SMALL_GAP - 1..small.end + SMALL_GAP + 9;
    file.expect(vec![small.clone(), near.clone()]);
    for stretch in [small, near] {
        read(&mut file, stretch.start as usize, (stretch.end - stretch.start) as usize);
    }
    assert_eq!(file.fetched().unwrap().requests, 1 + 3 + 1);
}

#[test]
fn what_was_not_expected_can_be_read() {
    let all = bytes(SIZE);
    let mut file =
        RemoteFile::of(Store::with(all.clone()).open("test://unexpected", true).unwrap());
    file.expect(vec![10 << 20..11 << 20, 30 << 20..31 << 20]);
    for start in [5 << 20, 10 << 20, 12 << 20, 9 << 20] {
        assert!(read(&mut file, start, 3 << 20) == all[start..start + (3 << 20)]);
    }
}

#[test]
fn opened_again_and_looked_at_little_costs_little() {
    let store = Store::with(bytes(SIZE));
    let address = "test://again";
    let object = store.open(address, true).unwrap();
    for _ in 0..3 {
        let mut file = RemoteFile::open(Path::new(address)).unwrap();
        read(&mut file, 0, 100);
        read(&mut file, SIZE - 1000, 1000);
        read(&mut file, SIZE / 2, 1000);
    }
    assert_eq!((object.fetched().requests, object.fetched().bytes), (3, ENDS + FIRST));
}

#[test]
fn an_end_that_is_kept() {
    let all = bytes(SIZE);
    let mut file = RemoteFile::of(Store::with(all.clone()).open("test://end", true).unwrap());
    let start = SIZE - (1 << 20);
    for _ in 0..2 {
        file.keep_end(start as u64).unwrap();
        assert!(read(&mut file, start, SIZE) == all[start..]);
    }
    assert_eq!((file.fetched().unwrap().requests, file.fetched().unwrap().bytes), (2, 1 << 20));
    // Too much to keep is read like anything else.
    file.keep_end(0).unwrap();
    assert_eq!(file.fetched().unwrap().requests, 2);
}

#[test]
fn small_ones_come_whole() {
    for size in [1, 1000, 64 << 10, 65 << 10, 256 << 10] {
        for gives_ends in [true, false] {
            let all = bytes(size);
            let object = Store::with(all.clone()).open("test://small", gives_ends).unwrap();
            let mut file = RemoteFile::of(object);
            assert!(read(&mut file, 0, size + 1) == all, "{size}");
            let is_twice = !gives_ends && size > 64 << 10;
            assert_eq!(file.fetched().unwrap().requests, 1 + u64::from(is_twice), "{size}");
        }
    }
}

#[test]
fn one_that_changes_is_refused_and_then_met_anew() {
    for (name, change) in [("other", bytes(SIZE - 1)), ("equal", bytes(SIZE))] {
        let address = format!("test://changes/{name}");
        let store = Store::with(bytes(SIZE));
        let object = store.open(&address, true).unwrap();
        let mut file = RemoteFile::of(object);
        assert_eq!(read(&mut file, 0, 10).len(), 10);
        store.put(change);
        file.seek(SeekFrom::Start(PIECE)).unwrap();
        let error = file.read(&mut [0; 10]).unwrap_err().to_string();
        assert_eq!(error, "the object changed while it was read");
        // It is asked for again, in a store that is not known.
        let again = RemoteFile::open(Path::new(&address)).err().unwrap().to_string();
        assert!(again.contains("unknown kind"), "{again}");
    }
}

#[test]
fn what_is_not_there_or_empty_is_named() {
    let opened = |store: Store| store.open("test://x", true).err().unwrap().to_string();
    assert_eq!(opened(Store(Arc::default())), "not found");
}

#[test]
fn addresses_that_name_nothing() {
    let problem = |address: &str| Place::of(Path::new(address)).err().unwrap().to_string();
    for address in ["s3://bucket", "s3://bucket/", "gs:///key", "az://"] {
        assert!(problem(address).contains("names no object"), "{address}");
    }
    assert!(problem("ftp://host/a.mcap").contains("known are s3, gs, az, http and https"));
    assert!(problem("s3://bucket/a//b").contains("empty path segment"));
    let secret = problem("https://host/a.mcap?secret=1");
    assert!(secret.contains("put_secrets_aside") && !secret.contains("secret=1"), "{secret}");
}
