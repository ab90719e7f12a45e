//! The owner's authority, as it is shown to devices that are to trust the page: its certificate, never its key.

use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A certificate is a hundredth of it.
const MOST_BYTES: u64 = 64 * 1024;
/// Longest name of a host with its port.
const HOST_BYTES: usize = 253 + 6;

/// What is wrong with the authority's file.
#[derive(Debug, thiserror::Error)]
#[error("https.authority {}: {reason}", .path.display())]
pub struct AuthorityError {
    path: PathBuf,
    reason: String,
}

/// The certificate of an authority.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Authority {
    /// The certificate, DER.
    pub(crate) certificate: Vec<u8>,
    /// Its SHA-256 in sixteen groups of four hexadecimal digits, as `sereno certs fingerprint` prints it.
    pub(crate) fingerprint: String,
}

impl Authority {
    /// Reads a PEM file with one certificate.
    ///
    /// # Errors
    /// Names the file and what is wrong with it; a private key in it is.
    pub(crate) fn read(path: &Path) -> Result<Self, AuthorityError> {
        let wrong = |reason: String| AuthorityError { path: path.to_owned(), reason };
        let file = std::fs::File::open(path).map_err(|error| wrong(error.to_string()))?;
        let mut text = String::new();
        file.take(MOST_BYTES + 1).read_to_string(&mut text).map_err(|error| wrong(error.to_string()))?;
        if text.len() as u64 > MOST_BYTES {
            return Err(wrong(format!("longer than {MOST_BYTES} bytes")));
        }
        // By its words, not by what a parser makes of it: encrypted or damaged, it is nobody's business.
        if text.contains("PRIVATE KEY") {
            return Err(wrong("holds a private key: name the certificate alone (ca.pem)".to_owned()));
        }
        let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(text.as_bytes()).collect();
        let found = found.map_err(|error| wrong(error.to_string()))?;
        let [certificate] = found.as_slice() else {
            return Err(wrong(format!("holds {} certificates in PEM form, allowed is 1", found.len())));
        };
        rustls::RootCertStore::empty()
            .add(certificate.clone())
            .map_err(|error| wrong(format!("is no certificate of an authority: {error}")))?;
        Ok(Self { certificate: certificate.to_vec(), fingerprint: fingerprint(certificate) })
    }

    /// The page that tells how to trust it: HTML without script, in both languages.
    pub(crate) fn page(&self) -> String {
        let groups: Vec<_> =
            self.fingerprint.split(' ').map(|group| format!("<span>{group}</span>")).collect();
        include_str!("../web/trust.html").replace("{fingerprint}", &groups.join(" "))
    }
}

fn fingerprint(certificate: &[u8]) -> String {
    let digits = crate::secret::hexadecimal(&crate::secret::digest_of(certificate)).to_uppercase();
    let groups = digits.as_bytes().chunks(4).map(String::from_utf8_lossy);
    groups.collect::<Vec<_>>().join(" ")
}

/// A QR code, SVG, of the page's address on this host; `None` for what is no host.
pub(crate) fn code(host: &str) -> Option<String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | ':' | '[' | ']');
    if host.is_empty() || host.len() > HOST_BYTES || !host.chars().all(plain) {
        return None;
    }
    let code = qrcode::QrCode::new(format!("https://{host}/trust")).ok()?;
    let mut picture = code.render::<qrcode::render::svg::Color<'_>>();
    // Cameras want it dark on light, whatever the page's colours.
    let picture = picture
        .min_dimensions(272, 272)
        .dark_color(qrcode::render::svg::Color("#000000"))
        .light_color(qrcode::render::svg::Color("#ffffff"));
    Some(picture.build())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn a_host_is_a_host() {
        for host in ["drone.local", "192.168.4.20:8443", "[fe80::1]:443", "xn--mnchen-3ya.example"] {
            assert!(code(host).unwrap().contains("<svg"), "{host}");
        }
        assert_ne!(code("a.example"), code("b.example"));
        for nonsense in ["", "a b", "a/b", "<svg>", "user@host", &"x".repeat(300)] {
            assert_eq!(code(nonsense), None, "{nonsense}");
        }
    }

    #[test]
    fn what_is_no_certificate_of_an_authority_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ca.pem");
        let key = rcgen::KeyPair::generate().unwrap();
        let mut params = rcgen::CertificateParams::new(Vec::new()).unwrap();
        params.is_ca = rcgen::IsCa::Ca(rcgen::BasicConstraints::Unconstrained);
        let pem = params.self_signed(&key).unwrap().pem();
        std::fs::write(&path, &pem).unwrap();
        let good = Authority::read(&path).unwrap();
        assert_eq!(good.fingerprint.len(), 16 * 5 - 1);
        assert!(!good.page().contains("{fingerprint}"));
        for (text, says) in [
            (String::new(), "0 certificates"),
            (format!("{pem}{pem}"), "2 certificates"),
            (format!("{pem}{}", key.serialize_pem()), "holds a private key"),
            (key.serialize_pem().replace("PRIVATE KEY", "ENCRYPTED PRIVATE KEY"), "holds a private key"),
            (
                "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n".to_owned(),
                "no certificate of an",
            ),
            ("x".repeat(70_000), "longer than"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = Authority::read(&path).unwrap_err().to_string();
            assert!(error.contains(says) && error.contains("ca.pem"), "{error}");
        }
        assert!(Authority::read(&folder.path().join("none")).is_err());
    }
}
