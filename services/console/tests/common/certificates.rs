//! An authority and identities for one test.

use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose,
};
use std::path::{Path, PathBuf};

pub struct Authority {
    issuer: Issuer<'static, KeyPair>,
    pub pem: PathBuf,
    folder: PathBuf,
}

pub struct Identity {
    pub certificate: PathBuf,
    pub key: PathBuf,
}

impl Authority {
    pub fn new(folder: &Path) -> Self {
        let mut params = CertificateParams::new(Vec::new()).unwrap();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        params.distinguished_name.push(DnType::CommonName, "authority of a test");
        let key = KeyPair::generate().unwrap();
        let certificate = params.self_signed(&key).unwrap();
        let pem = folder.join("ca.pem");
        std::fs::write(&pem, certificate.pem()).unwrap();
        Self { issuer: Issuer::new(params, key), pem, folder: folder.to_owned() }
    }

    pub fn identity(&self, name: &str) -> Identity {
        let mut params =
            CertificateParams::new(vec!["localhost".to_owned(), "127.0.0.1".to_owned()]).unwrap();
        params.distinguished_name.push(DnType::CommonName, name);
        params.extended_key_usages =
            vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
        let key = KeyPair::generate().unwrap();
        let signed = params.signed_by(&key, &self.issuer).unwrap();
        let certificate = self.folder.join(format!("{name}.pem"));
        let private = self.folder.join(format!("{name}.key"));
        std::fs::write(&certificate, signed.pem()).unwrap();
        std::fs::write(&private, key.serialize_pem()).unwrap();
        Identity { certificate, key: private }
    }

    /// A configuration of zenoh like the one that `sereno certs client` writes.
    pub fn zenoh(&self, name: &str, listen: &[String], connect: &[String]) -> serde_json::Value {
        let identity = self.identity(name);
        serde_json::json!({
            "mode": "peer",
            "metadata": { "certificate": name, "drones": [] },
            "connect": { "endpoints": connect },
            "listen": { "endpoints": listen },
            "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
            "transport": { "link": {
                "protocols": ["tls"],
                "tx": { "lease": 2000 },
                "tls": {
                    "root_ca_certificate": self.pem,
                    "listen_certificate": identity.certificate, "listen_private_key": identity.key,
                    "connect_certificate": identity.certificate, "connect_private_key": identity.key,
                    "enable_mtls": true, "verify_name_on_connect": true,
                },
            } },
        })
    }
}
