//! What the bridge needs before it speaks to anybody: its certificate, its key, the authority's and the list of clients.
//! Whatever is missing, ended or wrong is one sentence with file and field, and nothing is opened.

use crate::files::{check_private, read_text};
use crate::roles::Clients;
use crate::x509::{check_time, facts};
use crate::zenoh_config::Identity;
use std::path::Path;

/// Everything that was read, complete and valid at the time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Papers {
    /// Certificates and key.
    pub identity: Identity,
    /// Who is known.
    pub clients: Clients,
    /// When the first of the certificates ends, seconds since 1970.
    pub not_after_s: i64,
}

/// Reads the papers of a drone out of a directory that `sereno certs` made.
///
/// # Errors
/// One sentence with file and field.
pub fn read(directory: &Path, drone: &str, now_s: i64) -> Result<Papers, String> {
    if !directory.join("ca.pem").is_file() {
        return Err(format!("{} has no ca.pem: `sereno certs init` makes certificates", directory.display()));
    }
    let name = |path: &Path| path.display().to_string();
    let (authority_file, own_file, key_file, clients_file) = (
        directory.join("ca.pem"),
        directory.join(format!("{drone}.pem")),
        directory.join(format!("{drone}.key")),
        directory.join("clients.toml"),
    );
    let authority = read_text(&authority_file)?;
    let certificate = read_text(&own_file)?;
    check_private(&key_file)?;
    let key = read_text(&key_file)?;
    let above = facts(&name(&authority_file), &authority)?;
    let own = facts(&name(&own_file), &certificate)?;
    check_time(&name(&authority_file), &above, now_s)?;
    check_time(&name(&own_file), &own, now_s)?;
    if own.name != drone {
        return Err(format!(
            "{}: common name = {}: must be {drone}",
            name(&own_file),
            manifest::plain(&own.name)
        ));
    }
    crate::x509::check_signed(&name(&own_file), &certificate, &authority)?;
    crate::x509::check_key(&name(&key_file), &key, &certificate)?;
    let clients = Clients::parse(&name(&clients_file), &read_text(&clients_file)?)?;
    Ok(Papers {
        identity: Identity { authority, certificate, key },
        clients,
        not_after_s: own.not_after_s.min(above.not_after_s),
    })
}
