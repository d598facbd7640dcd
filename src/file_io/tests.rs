//! What stands on the disk after reading and writing.

use super::*;

#[cfg(unix)]
#[test]
fn replacing_keeps_links_and_permissions() {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let (file, link, plain) =
        (folder.path().join("file"), folder.path().join("link"), folder.path().join("plain"));
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    fs::write(&file, "old").unwrap();
    fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
    symlink(&file, &link).unwrap();
    replace_file(&link, b"new").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!((fs::read(&file).unwrap().as_slice(), mode(&file)), (&b"new"[..], 0o640));
    // A new file is like any other program's.
    fs::write(&plain, "").unwrap();
    replace_file(&folder.path().join("fresh"), b"").unwrap();
    assert_eq!(mode(&folder.path().join("fresh")), mode(&plain));
    // A link that leads to no file yet leads to the new one.
    let (ahead, end) = (folder.path().join("ahead"), folder.path().join("end"));
    symlink("end", &ahead).unwrap();
    replace_file(&ahead, b"first").unwrap();
    assert!(fs::symlink_metadata(&ahead).unwrap().is_symlink());
    assert_eq!(fs::read(&end).unwrap(), b"first");
    // A device is written to, not replaced.
    replace_file(Path::new("/dev/null"), b"gone").unwrap();
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
    // Nothing temporary is left.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 6);
}
