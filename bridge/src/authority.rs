//! The owner's small certificate authority: one directory, one authority, a certificate for each drone, program and page.
//!
//! ```text
//! ca.pem ca.key          the authority; the key is needed to make certificates only and may be carried away
//! clients.toml           names and roles
//! DRONE.pem DRONE.key    the identity of each drone
//! https.pem https.key    what the console shows to browsers
//! clients/NAME/          all that NAME needs on another machine: NAME.json5 is a complete configuration of zenoh
//! ```
//! Directories are 0700, keys and configurations that hold keys 0600. Times are arguments.

use crate::files::{make_directory, read_text, write_private, write_public};
use crate::roles::{Clients, Standing, is_name};
use crate::x509::{Facts, check_key, facts};
use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer,
    KeyPair, KeyUsagePurpose, date_time_ymd,
};
use std::path::{Path, PathBuf};
use std::time::Duration;

const DAY: Duration = Duration::from_secs(86_400);
/// Ten years: the authority is trusted by hand on every machine, and a drone outlives no more.
const AUTHORITY_LIFE: Duration = Duration::from_secs(3653 * 86_400);
/// One year: long enough not to be renewed in a hurry, short enough that a lost one ends.
const LEAF_LIFE: Duration = Duration::from_secs(366 * 86_400);
/// What ends within this time is renewed.
const RENEW_BEFORE: Duration = Duration::from_secs(60 * 86_400);
/// Clocks of other machines may be behind by so much.
const CLOCKS: Duration = DAY;

/// What could not be done with certificates, in one sentence.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct CertificateError(pub String);

impl From<String> for CertificateError {
    fn from(text: String) -> Self {
        Self(text)
    }
}

type Result<T> = std::result::Result<T, CertificateError>;

fn failed(what: &str) -> impl FnOnce(rcgen::Error) -> CertificateError + '_ {
    move |error| CertificateError(format!("{what}: {error}"))
}

/// A directory of certificates.
#[derive(Debug, Clone)]
pub struct Authority {
    directory: PathBuf,
}

/// One certificate, as `sereno certs list` shows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// Its name.
    pub name: String,
    /// What it stands for: a role, `router`, `drone`, `authority`, `page`, or `untrusted` when no list has it.
    pub standing: String,
    /// When it ends, seconds since 1970.
    pub not_after_s: i64,
    /// Where it is.
    pub file: PathBuf,
}

/// What a leaf is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    /// Connects to drones and routers.
    Client,
    /// Is connected to, and connects to routers.
    Server,
    /// Is shown to browsers.
    Page,
}

/// Names and addresses under which a server is reached, beside this machine's own.
fn with_local(names: &[String]) -> Vec<String> {
    let mut all: Vec<String> = ["localhost", "127.0.0.1", "::1"].map(str::to_owned).into();
    for name in names {
        if !all.contains(name) {
            all.push(name.clone());
        }
    }
    all
}

/// Whether a host may stand in a certificate.
fn check_host(name: &str) -> Result<()> {
    let address = name.parse::<std::net::IpAddr>().is_ok();
    let plain = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'.'));
    if address || (plain && !name.is_empty() && name.len() <= 253) {
        return Ok(());
    }
    Err(CertificateError(format!("{name:?} is no host name and no address")))
}

fn check_name(name: &str) -> Result<()> {
    if is_name(name) && !["ca", "https", "clients"].contains(&name) {
        return Ok(());
    }
    Err(CertificateError(format!(
        "{name:?} is no name for a certificate: 1 to {} letters, digits, - _ and ., not ca, https or clients",
        crate::roles::MAX_NAME
    )))
}

impl Authority {
    /// The authority in `directory`, which need not exist yet.
    pub fn at(directory: impl Into<PathBuf>) -> Self {
        Self { directory: directory.into() }
    }

    /// Whether there is one.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.path("ca.pem").is_file()
    }

    /// Where it is.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    fn path(&self, file: &str) -> PathBuf {
        self.directory.join(file)
    }

    /// Where the configuration of a client is.
    #[must_use]
    pub fn client_config(&self, name: &str) -> PathBuf {
        self.client_directory(name).join(format!("{name}.json5"))
    }

    fn client_directory(&self, name: &str) -> PathBuf {
        self.path("clients").join(name)
    }

    /// Makes the authority, the identities of `drones`, the page's certificate and the console's client. `hosts` are names
    /// and addresses by which drones and console are reached from other machines; `endpoints` where the console finds
    /// the drones. What is there already stays as it is.
    ///
    /// # Errors
    /// When a name is none, or a file cannot be read or written.
    pub fn init(&self, drones: &[String], hosts: &[String], endpoints: &[String], now_s: i64) -> Result<()> {
        make_directory(&self.directory)?;
        if !self.exists() {
            self.make_authority(drones.first().map_or("drone", String::as_str), now_s)?;
        }
        if !self.path("clients.toml").is_file() {
            self.save(&Clients::default())?;
        }
        for drone in drones {
            if !self.path(&format!("{drone}.pem")).is_file() {
                self.drone(drone, hosts, now_s)?;
            }
        }
        if !self.path("https.pem").is_file() {
            self.page(hosts, now_s)?;
        }
        if !self.client_config("console").is_file() {
            self.client(
                "console",
                Standing::from_word("administrator").ok_or_else(unreachable)?,
                endpoints,
                now_s,
            )?;
        }
        Ok(())
    }

    fn make_authority(&self, owner: &str, now_s: i64) -> Result<()> {
        let key = KeyPair::generate().map_err(failed("no key for the authority"))?;
        // Browsers and trust stores list authorities by name: two of them must not look alike.
        let mark: String =
            key.public_key_raw().iter().rev().take(4).map(|byte| format!("{byte:02x}")).collect();
        let mut params = authority_params(&format!("Sereno {owner} {mark}"));
        (params.not_before, params.not_after) =
            (time(now_s, CLOCKS, false), time(now_s, AUTHORITY_LIFE, true));
        let certificate = params.self_signed(&key).map_err(failed("no certificate for the authority"))?;
        write_private(&self.path("ca.key"), key.serialize_pem().as_bytes())?;
        write_public(&self.path("ca.pem"), certificate.pem().as_bytes())?;
        Ok(())
    }

    fn issuer(&self) -> Result<Issuer<'static, KeyPair>> {
        let (certificate, key) = (self.path("ca.pem"), self.path("ca.key"));
        let pem = read_text(&certificate)?;
        let key_pem = read_text(&key)
            .map_err(|error| format!("{error} (certificates are made where the authority's key is)"))?;
        let key_pair = KeyPair::from_pem(&key_pem)
            .map_err(|error| CertificateError(format!("{}: no private key: {error}", key.display())))?;
        check_key(&key.display().to_string(), &key_pem, &pem)?;
        let Facts { name, .. } = facts(&certificate.display().to_string(), &pem)?;
        Ok(Issuer::new(authority_params(&name), key_pair))
    }

    /// Certificate and key, both PEM.
    fn leaf(&self, name: &str, hosts: &[String], purpose: Use, now_s: i64) -> Result<(String, String)> {
        let issuer = self.issuer()?;
        hosts.iter().try_for_each(|host| check_host(host))?;
        let key = KeyPair::generate().map_err(failed("no key"))?;
        let mut params = CertificateParams::new(hosts).map_err(failed("the names of the certificate"))?;
        params.distinguished_name = common_name(name);
        params.is_ca = IsCa::ExplicitNoCa;
        params.use_authority_key_identifier_extension = true;
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        // A client must not be able to pass for a drone.
        params.extended_key_usages = match purpose {
            Use::Client => vec![ExtendedKeyUsagePurpose::ClientAuth],
            Use::Server => vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth],
            Use::Page => vec![ExtendedKeyUsagePurpose::ServerAuth],
        };
        (params.not_before, params.not_after) = (time(now_s, CLOCKS, false), time(now_s, LEAF_LIFE, true));
        let certificate = params.signed_by(&key, &issuer).map_err(failed("cannot sign"))?;
        Ok((certificate.pem(), key.serialize_pem()))
    }

    fn pair(&self, stem: &str, (certificate, key): &(String, String)) -> Result<()> {
        write_private(&self.path(&format!("{stem}.key")), key.as_bytes())?;
        write_public(&self.path(&format!("{stem}.pem")), certificate.as_bytes())?;
        Ok(())
    }

    /// Makes the identity of a drone, reached at `hosts` besides this machine's own names, and puts it on the list.
    ///
    /// # Errors
    /// As [`Authority::init`].
    pub fn drone(&self, name: &str, hosts: &[String], now_s: i64) -> Result<()> {
        check_name(name)?;
        self.pair(name, &self.leaf(name, &with_local(hosts), Use::Server, now_s)?)?;
        let mut clients = self.clients()?;
        clients.set(name, Standing::Drone);
        self.save(&clients)
    }

    /// Makes the certificate that the console shows to browsers, for this machine's own names and `hosts`.
    ///
    /// # Errors
    /// As [`Authority::init`].
    pub fn page(&self, hosts: &[String], now_s: i64) -> Result<()> {
        self.pair("https", &self.leaf("Sereno console", &with_local(hosts), Use::Page, now_s)?)
    }

    /// Makes everything that a program needs to speak to the drones at `endpoints`, and puts it on the list. Answers the
    /// directory to be carried to its machine.
    ///
    /// # Errors
    /// As [`Authority::init`]; also when no endpoint is given or one is not TLS.
    pub fn client(
        &self,
        name: &str,
        standing: Standing,
        endpoints: &[String],
        now_s: i64,
    ) -> Result<PathBuf> {
        check_name(name)?;
        let mut clients = self.clients()?;
        if clients.standing(name) == Some(Standing::Drone) {
            return Err(CertificateError(format!("{name} is the name of a drone")));
        }
        self.write_client(name, standing, endpoints, now_s)?;
        clients.set(name, standing);
        self.save(&clients)?;
        Ok(self.client_directory(name))
    }

    fn write_client(&self, name: &str, standing: Standing, endpoints: &[String], now_s: i64) -> Result<()> {
        let endpoints: Vec<&str> = endpoints.iter().map(String::as_str).collect();
        if endpoints.is_empty() || endpoints.iter().any(|endpoint| !endpoint.starts_with("tls/")) {
            return Err(CertificateError("an endpoint is needed, as tls/192.168.4.20:7447".into()));
        }
        let server = standing == Standing::Router;
        let hosts = if server {
            with_local(&endpoints.iter().filter_map(|e| host_of(e)).collect::<Vec<_>>())
        } else {
            Vec::new()
        };
        let (certificate, key) =
            self.leaf(name, &hosts, if server { Use::Server } else { Use::Client }, now_s)?;
        let authority = read_text(&self.path("ca.pem"))?;
        let drones: Vec<String> = self
            .clients()?
            .iter()
            .filter(|(_, standing)| *standing == Standing::Drone)
            .map(|(name, _)| name.to_owned())
            .collect();
        make_directory(&self.path("clients"))?;
        let place = self.client_directory(name);
        make_directory(&place)?;
        let config = if server {
            crate::zenoh_config::router(name, &endpoints, &self.clients()?, &authority, &certificate, &key)
        } else {
            crate::zenoh_config::client(name, &drones, &endpoints, &authority, &certificate, &key)
        };
        write_private(&place.join(format!("{name}.key")), key.as_bytes())?;
        write_public(&place.join(format!("{name}.pem")), certificate.as_bytes())?;
        write_public(&place.join("ca.pem"), authority.as_bytes())?;
        write_private(&place.join(format!("{name}.json5")), config.as_bytes())?;
        Ok(())
    }

    /// Takes a client off the list: the drone refuses it from then on. False when it was not on it.
    ///
    /// # Errors
    /// When the list cannot be read or written.
    pub fn revoke(&self, name: &str) -> Result<bool> {
        let mut clients = self.clients()?;
        let was = clients.remove(name);
        self.save(&clients)?;
        Ok(was)
    }

    /// The list of names and roles.
    ///
    /// # Errors
    /// When it is missing or wrong.
    pub fn clients(&self) -> Result<Clients> {
        let path = self.path("clients.toml");
        Ok(Clients::parse(&path.display().to_string(), &read_text(&path)?)?)
    }

    fn save(&self, clients: &Clients) -> Result<()> {
        Ok(write_public(&self.path("clients.toml"), clients.to_toml().as_bytes())?)
    }

    /// Every certificate in the directory, by file.
    ///
    /// # Errors
    /// When one cannot be read.
    pub fn list(&self) -> Result<Vec<Listed>> {
        let clients = self.clients()?;
        let mut files = pem_files(&self.directory)?;
        if let Ok(entries) = std::fs::read_dir(self.path("clients")) {
            for place in entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()) {
                files.extend(
                    pem_files(&place)?.into_iter().filter(|file| file.file_name() != Some("ca.pem".as_ref())),
                );
            }
        }
        files.sort();
        let mut all = Vec::new();
        for file in files {
            let Facts { name, not_after_s, .. } = facts(&file.display().to_string(), &read_text(&file)?)?;
            let standing = match file.file_stem().and_then(|stem| stem.to_str()) {
                Some("ca") => "authority",
                Some("https") => "page",
                _ => clients.standing(&name).map_or("untrusted", Standing::word),
            };
            all.push(Listed { name, standing: standing.to_owned(), not_after_s, file });
        }
        Ok(all)
    }

    /// Makes every certificate again that ends within 60 days (`all`: every one) and answers their names. The
    /// authority's own stays. Directories of clients must be carried to their machines again.
    ///
    /// # Errors
    /// As [`Authority::init`].
    pub fn renew(&self, all: bool, now_s: i64) -> Result<Vec<String>> {
        let clients = self.clients()?;
        let mut renewed = Vec::new();
        for listed in self.list()? {
            let left_s = listed.not_after_s - now_s;
            if listed.standing == "authority" || !(all || left_s < RENEW_BEFORE.as_secs().cast_signed()) {
                continue;
            }
            let old = facts(&listed.file.display().to_string(), &read_text(&listed.file)?)?;
            match listed.standing.as_str() {
                "page" => self.page(&old.hosts, now_s)?,
                "drone" => self.drone(&old.name, &old.hosts, now_s)?,
                "untrusted" => continue,
                _ => {
                    let config = read_text(&self.client_config(&old.name))?;
                    let endpoints = crate::zenoh_config::endpoints_of(&config).ok_or_else(|| {
                        CertificateError(format!(
                            "{}: no endpoints in it",
                            self.client_config(&old.name).display()
                        ))
                    })?;
                    let Some(standing) = clients.standing(&old.name) else { continue };
                    self.write_client(&old.name, standing, &endpoints, now_s)?;
                }
            }
            renewed.push(listed.name);
        }
        Ok(renewed)
    }
}

fn unreachable() -> CertificateError {
    CertificateError("a role has lost its name".into())
}

/// The host of `tls/HOST:PORT`.
fn host_of(endpoint: &str) -> Option<String> {
    let (host, _) = endpoint.strip_prefix("tls/")?.rsplit_once(':')?;
    Some(host.trim_matches(['[', ']']).to_owned())
}

/// What an authority of this name is; the same for its own certificate and for those that it signs.
fn authority_params(name: &str) -> CertificateParams {
    let mut params = CertificateParams::default();
    params.distinguished_name = common_name(name);
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    params
}

fn common_name(name: &str) -> DistinguishedName {
    let mut distinguished = DistinguishedName::new();
    distinguished.push(DnType::CommonName, name);
    distinguished
}

fn time(now_s: i64, distance: Duration, later: bool) -> time::OffsetDateTime {
    let epoch = date_time_ymd(1970, 1, 1) + Duration::from_secs(now_s.max(0).cast_unsigned());
    if later { epoch + distance } else { epoch - distance }
}

fn pem_files(directory: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(directory)
        .map_err(|error| CertificateError(format!("cannot read {}: {error}", directory.display())))?;
    Ok(entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "pem"))
        .collect())
}
