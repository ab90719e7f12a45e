//! What a certificate says.

use x509_parser::extensions::{GeneralName, ParsedExtension};
use x509_parser::pem::parse_x509_pem;

/// What a certificate says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Facts {
    /// Its common name.
    pub name: String,
    /// Host names and addresses that it stands for.
    pub hosts: Vec<String>,
    /// Before this it does not count, seconds since 1970.
    pub not_before_s: i64,
    /// After this it does not count, seconds since 1970.
    pub not_after_s: i64,
}

/// Reads the first certificate of a PEM text; `file` is how it is called in messages.
///
/// # Errors
/// One sentence naming the file.
pub fn facts(file: &str, pem: &str) -> Result<Facts, String> {
    let wrong = |error: &dyn std::fmt::Display| format!("{file}: no certificate in PEM form: {error}");
    let (_, block) = parse_x509_pem(pem.as_bytes()).map_err(|error| wrong(&error))?;
    let certificate = block.parse_x509().map_err(|error| wrong(&error))?;
    let name = certificate
        .subject()
        .iter_common_name()
        .next()
        .and_then(|name| name.as_str().ok())
        .ok_or_else(|| format!("{file}: the certificate has no common name"))?
        .to_owned();
    let mut hosts = Vec::new();
    if let Ok(Some(names)) = certificate.subject_alternative_name() {
        for general in &names.value.general_names {
            match general {
                GeneralName::DNSName(host) => hosts.push((*host).to_owned()),
                GeneralName::IPAddress(bytes) => hosts.extend(address(bytes)),
                _ => {}
            }
        }
    }
    let validity = certificate.validity();
    Ok(Facts {
        name,
        hosts,
        not_before_s: validity.not_before.timestamp(),
        not_after_s: validity.not_after.timestamp(),
    })
}

/// The SHA-256 of the first certificate of a PEM text, in sixteen groups of four hexadecimal digits; `file` as in [`facts`].
///
/// # Errors
/// One sentence naming the file.
pub fn fingerprint(file: &str, pem: &str) -> Result<String, String> {
    let (_, block) = parse_x509_pem(pem.as_bytes())
        .map_err(|error| format!("{file}: no certificate in PEM form: {error}"))?;
    let digest = ring::digest::digest(&ring::digest::SHA256, &block.contents);
    let groups = digest.as_ref().chunks(2);
    let groups = groups.map(|pair| pair.iter().map(|byte| format!("{byte:02X}")).collect::<String>());
    Ok(groups.collect::<Vec<_>>().join(" "))
}

fn address(bytes: &[u8]) -> Option<String> {
    if let Ok(four) = <[u8; 4]>::try_from(bytes) {
        return Some(std::net::Ipv4Addr::from(four).to_string());
    }
    <[u8; 16]>::try_from(bytes).ok().map(|sixteen| std::net::Ipv6Addr::from(sixteen).to_string())
}

/// Refuses a certificate that does not count now.
///
/// # Errors
/// One sentence naming the file, and since or until when.
pub fn check_time(file: &str, facts: &Facts, now_s: i64) -> Result<(), String> {
    if now_s > facts.not_after_s {
        let days = (now_s - facts.not_after_s) / 86_400;
        return Err(format!(
            "{file}: not_after: the certificate ended {days} days ago: `sereno certs renew` makes new ones"
        ));
    }
    if now_s < facts.not_before_s {
        return Err(format!(
            "{file}: not_before: the certificate does not count yet: is this machine's clock right?"
        ));
    }
    Ok(())
}

/// Refuses a certificate that names another authority than this one.
///
/// # Errors
/// One sentence naming the file.
pub fn check_signed(file: &str, certificate: &str, authority: &str) -> Result<(), String> {
    let wrong = || format!("{file}: issuer: the authority in ca.pem has not signed this certificate");
    let (_, block) = parse_x509_pem(certificate.as_bytes()).map_err(|_| wrong())?;
    let (_, above) = parse_x509_pem(authority.as_bytes()).map_err(|_| wrong())?;
    let (leaf, root) = (block.parse_x509().map_err(|_| wrong())?, above.parse_x509().map_err(|_| wrong())?);
    // Names its key, too: two authorities of one name differ. TLS itself checks the signature, at the other side.
    let named = leaf.iter_extensions().find_map(|extension| match extension.parsed_extension() {
        ParsedExtension::AuthorityKeyIdentifier(id) => id.key_identifier.as_ref().map(|key| key.0.to_vec()),
        _ => None,
    });
    let own = root.iter_extensions().find_map(|extension| match extension.parsed_extension() {
        ParsedExtension::SubjectKeyIdentifier(key) => Some(key.0.to_vec()),
        _ => None,
    });
    let signed = leaf.issuer().as_raw() == root.subject().as_raw() && named.is_some() && named == own;
    if signed { Ok(()) } else { Err(wrong()) }
}

/// Refuses a key that is not the certificate's.
///
/// # Errors
/// One sentence naming the file, and nothing of the key.
pub fn check_key(file: &str, key: &str, certificate: &str) -> Result<(), String> {
    let pair = rcgen::KeyPair::from_pem(key).map_err(|_| format!("{file}: no private key in PEM form"))?;
    let own = parse_x509_pem(certificate.as_bytes())
        .ok()
        .and_then(|(_, block)| Some(block.parse_x509().ok()?.public_key().subject_public_key.data.to_vec()));
    if own.as_deref() == Some(pair.public_key_raw()) {
        return Ok(());
    }
    Err(format!("{file}: the key belongs to another certificate"))
}
