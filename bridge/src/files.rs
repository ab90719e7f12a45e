//! Files that hold secrets, and those that do not.

use std::io::Write;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::Path;

/// The largest file that is read here, bytes: a list of clients or a chain of certificates is a few kilobytes.
const MAX_FILE: u64 = 1 << 20;

/// Makes a directory that its owner alone may enter.
///
/// # Errors
/// One sentence naming the directory.
pub(crate) fn make_directory(path: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("cannot make {}: {error}", path.display());
    if !path.is_dir() {
        std::fs::DirBuilder::new().recursive(true).mode(0o700).create(path).map_err(failed)?;
    }
    Ok(())
}

/// Writes what its owner alone may read: whole or not at all.
///
/// # Errors
/// One sentence naming the file.
pub(crate) fn write_private(path: &Path, bytes: &[u8]) -> Result<(), String> {
    write(path, bytes, 0o600)
}

/// Writes what anybody may read who may enter the directory: whole or not at all.
///
/// # Errors
/// One sentence naming the file.
pub(crate) fn write_public(path: &Path, bytes: &[u8]) -> Result<(), String> {
    write(path, bytes, 0o644)
}

fn write(path: &Path, bytes: &[u8], mode: u32) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("cannot write {}: {error}", path.display());
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".new");
    let new = path.with_file_name(name);
    // Left by somebody who was stopped here; it may have other rights.
    let _ = std::fs::remove_file(&new);
    let mut file =
        std::fs::OpenOptions::new().write(true).create_new(true).mode(mode).open(&new).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.sync_all().map_err(failed)?;
    std::fs::rename(&new, path).map_err(failed)
}

/// Reads a small text.
///
/// # Errors
/// One sentence naming the file.
pub(crate) fn read_text(path: &Path) -> Result<String, String> {
    let failed = |error: std::io::Error| format!("cannot read {}: {error}", path.display());
    let size = std::fs::metadata(path).map_err(failed)?.len();
    if size > MAX_FILE {
        return Err(format!("{}: {size} bytes: allowed are at most {MAX_FILE}", path.display()));
    }
    std::fs::read_to_string(path).map_err(failed)
}

/// Refuses a secret that others may read.
///
/// # Errors
/// One sentence naming the file and its mode.
pub(crate) fn check_private(path: &Path) -> Result<(), String> {
    let mode = std::fs::metadata(path)
        .map_err(|error| format!("cannot read {}: {error}", path.display()))?
        .permissions()
        .mode()
        & 0o777;
    if mode & 0o077 == 0 {
        return Ok(());
    }
    Err(format!(
        "{}: mode {mode:o}: a private key must be readable by its owner alone (chmod 600)",
        path.display()
    ))
}
