//! Files under a temporary name, while others are about.

use std::fs;

use super::fixtures::Folder;
use crate::{PartialFile, create_hidden, lock_left, write_file};

#[test]
fn a_file_is_locked_until_it_has_its_name() {
    let folder = Folder::new();
    let output = folder.path("out.json");
    let hidden = PartialFile::name_for(&output);
    let (file, partial) = PartialFile::create(&output, false).unwrap();
    drop(file);
    let busy = lock_left(&hidden).unwrap_err().to_string();
    assert!(busy.contains("being written by another run"), "{busy}");
    let busy = PartialFile::create(&output, false).map(drop).unwrap_err().to_string();
    assert!(busy.contains("being written by another run"), "{busy}");
    partial.put().unwrap();
    assert!(lock_left(&hidden).unwrap().is_none());
    assert_eq!(folder.names(), ["out.json"]);
}

#[test]
fn another_file_under_the_temporary_name_never_gets_the_output() {
    let folder = Folder::new();
    let output = folder.path("out.json");
    let hidden = PartialFile::name_for(&output);
    let (_file, partial) = PartialFile::create(&output, false).unwrap();
    fs::remove_file(&hidden).unwrap();
    fs::write(&hidden, "of another run").unwrap();
    let error = partial.put().unwrap_err().to_string();
    assert!(error.contains("replaced by another"), "{error}");
    assert!(!output.exists());
    assert_eq!(fs::read(&hidden).unwrap(), b"of another run");
}

#[test]
fn names_without_room_for_hidden_companions_are_refused() {
    let folder = Folder::new();
    let longest = folder.path(&"n".repeat(242));
    write_file(&longest, b"", false).unwrap();
    let error = write_file(&folder.path(&"n".repeat(243)), b"", false).unwrap_err().to_string();
    assert!(error.contains("243 bytes") && error.contains("at most 242"), "{error}");
}

#[cfg(unix)]
#[test]
fn an_output_keeps_the_permissions_of_the_file_that_it_replaces() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let output = folder.path("out.json");
    fs::write(&output, "older").unwrap();
    fs::set_permissions(&output, fs::Permissions::from_mode(0o600)).unwrap();
    write_file(&output, b"newer", true).unwrap();
    assert_eq!(fs::read(&output).unwrap(), b"newer");
    assert_eq!(fs::metadata(&output).unwrap().permissions().mode() & 0o777, 0o600);
}

#[cfg(unix)]
#[test]
fn links_are_neither_followed_nor_replaced() {
    use std::os::unix::fs::symlink;
    let folder = Folder::new();
    let victim = folder.path("victim");
    fs::write(&victim, "precious").unwrap();
    let output = folder.path("out.json");
    let hidden = PartialFile::name_for(&output);
    symlink(&victim, &hidden).unwrap();
    for error in [
        write_file(&output, b"new", true).unwrap_err(),
        create_hidden(&hidden).map(drop).unwrap_err(),
    ] {
        assert!(error.to_string().contains("is a link"), "{error}");
    }
    fs::remove_file(&hidden).unwrap();
    symlink(&victim, &output).unwrap();
    let error = write_file(&output, b"new", true).unwrap_err().to_string();
    assert!(error.contains("is a link, which is not replaced"), "{error}");
    assert_eq!(fs::read(&victim).unwrap(), b"precious");
}
