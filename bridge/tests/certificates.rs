//! Certificates: what is made is accepted, what is missing, ended or somebody else's is named, secrets are kept.
#![allow(clippy::unwrap_used, reason = "tests")]

use bridge::roles::{Role, Standing};
use bridge::{Authority, identity, x509};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

const NOW_S: i64 = 1_800_000_000;
const DAY_S: i64 = 86_400;
const HERE: &str = "tls/127.0.0.1:7447";

fn guard() -> Standing {
    Standing::Client(Role::Guard)
}

fn made(directory: &Path) -> Authority {
    let authority = Authority::at(directory.join("certs"));
    authority
        .init(&["sereno-1".into()], &["drone.lan".into(), "10.0.0.7".into()], &[HERE.into()], NOW_S)
        .unwrap();
    authority
}

#[test]
fn what_is_made_is_accepted_and_secrets_are_the_owners() {
    let directory = tempfile::tempdir().unwrap();
    let authority = made(directory.path());
    authority.client("desk", guard(), &[HERE.into()], NOW_S).unwrap();
    let papers = identity::read(authority.directory(), "sereno-1", NOW_S).unwrap();
    assert_eq!(papers.clients.role("desk"), Some(Role::Guard));
    assert_eq!(papers.clients.role("console"), Some(Role::Administrator));
    assert_eq!(papers.clients.standing("sereno-1"), Some(Standing::Drone));
    let mut secrets = 0;
    let mut waiting = vec![authority.directory().to_owned()];
    while let Some(place) = waiting.pop() {
        assert_eq!(fs::metadata(&place).unwrap().permissions().mode() & 0o777, 0o700, "{}", place.display());
        for entry in fs::read_dir(&place).unwrap().flatten() {
            let (path, mode) = (entry.path(), entry.metadata().unwrap().permissions().mode() & 0o777);
            if path.is_dir() {
                waiting.push(path);
                continue;
            }
            let text = fs::read_to_string(&path).unwrap();
            let secret = text.contains("PRIVATE KEY") || text.contains("private_key");
            assert_eq!(mode, if secret { 0o600 } else { 0o644 }, "{}", path.display());
            secrets += usize::from(secret);
        }
    }
    assert_eq!(
        secrets,
        3 + 2 * 2,
        "authority, drone and page; two clients with a key and a configuration each"
    );
}

#[test]
fn what_is_there_stays() {
    let directory = tempfile::tempdir().unwrap();
    let authority = made(directory.path());
    let before = fs::read(authority.directory().join("sereno-1.key")).unwrap();
    authority.client("desk", guard(), &[HERE.into()], NOW_S).unwrap();
    authority.init(&["sereno-1".into(), "sereno-2".into()], &[], &[HERE.into()], NOW_S).unwrap();
    assert_eq!(fs::read(authority.directory().join("sereno-1.key")).unwrap(), before);
    assert!(identity::read(authority.directory(), "sereno-2", NOW_S).is_ok());
    assert_eq!(authority.clients().unwrap().role("desk"), Some(Role::Guard));
}

#[test]
fn what_is_wrong_is_named_with_file_and_field() {
    type Damage = fn(&Path, &Path);
    let cases: [(&str, i64, Damage, &str); 10] = [
        ("nothing", 0, |own, _| fs::remove_dir_all(own).unwrap(), "has no ca.pem: `sereno certs init` makes"),
        (
            "no key",
            0,
            |own, _| fs::remove_file(own.join("sereno-1.key")).unwrap(),
            "sereno-1.key: No such file",
        ),
        ("ended", 500 * DAY_S, |_, _| {}, "sereno-1.pem: not_after: the certificate ended 134 days ago"),
        ("not yet", -3 * DAY_S, |_, _| {}, "not_before: the certificate does not count yet"),
        (
            "readable",
            0,
            |own, _| {
                fs::set_permissions(own.join("sereno-1.key"), fs::Permissions::from_mode(0o644)).unwrap();
            },
            "sereno-1.key: mode 644: a private key must be readable by its owner alone",
        ),
        (
            "another's key",
            0,
            |own, other| {
                fs::copy(other.join("sereno-1.key"), own.join("sereno-1.key")).unwrap();
            },
            "sereno-1.key: the key belongs to another certificate",
        ),
        (
            "another authority",
            0,
            |own, other| {
                fs::copy(other.join("ca.pem"), own.join("ca.pem")).unwrap();
            },
            "sereno-1.pem: issuer: the authority in ca.pem has not signed this certificate",
        ),
        (
            "another name",
            0,
            |own, _| {
                fs::copy(own.join("https.pem"), own.join("sereno-1.pem")).unwrap();
            },
            "sereno-1.pem: common name = Sereno console: must be sereno-1",
        ),
        (
            "junk",
            0,
            |own, _| fs::write(own.join("sereno-1.pem"), b"junk").unwrap(),
            "no certificate in PEM form",
        ),
        (
            "no list",
            0,
            |own, _| fs::write(own.join("clients.toml"), "[client.desk]\nrole = 3").unwrap(),
            "clients.toml: ",
        ),
    ];
    let other = tempfile::tempdir().unwrap();
    let others = made(other.path());
    for (what, later_s, damage, said) in cases {
        let directory = tempfile::tempdir().unwrap();
        let authority = made(directory.path());
        damage(authority.directory(), others.directory());
        let error = identity::read(authority.directory(), "sereno-1", NOW_S + later_s).unwrap_err();
        assert!(error.contains(said), "{what}: {error}");
        assert!(!error.contains('\n') && !error.contains("PRIVATE"), "{what}: {error}");
    }
}

#[test]
fn renewal_makes_anew_what_ends_soon_and_keeps_names_roles_and_places() {
    let directory = tempfile::tempdir().unwrap();
    let authority = made(directory.path());
    authority.client("desk", guard(), &["tls/drone.lan:7447".into()], NOW_S).unwrap();
    assert_eq!(authority.renew(false, NOW_S).unwrap(), Vec::<String>::new());
    let later = NOW_S + 320 * DAY_S;
    let mut renewed = authority.renew(false, later).unwrap();
    renewed.sort();
    assert_eq!(renewed, ["Sereno console", "console", "desk", "sereno-1"]);
    let papers = identity::read(authority.directory(), "sereno-1", later + 200 * DAY_S).unwrap();
    assert_eq!(papers.clients.role("desk"), Some(Role::Guard));
    let pem = fs::read_to_string(authority.directory().join("sereno-1.pem")).unwrap();
    let hosts = x509::facts("sereno-1.pem", &pem).unwrap().hosts;
    assert_eq!(hosts, ["localhost", "127.0.0.1", "::1", "drone.lan", "10.0.0.7"]);
    let config = fs::read_to_string(authority.client_config("desk")).unwrap();
    assert!(config.contains("tls/drone.lan:7447"), "{config}");
}

#[test]
fn a_revoked_client_is_off_the_list_and_bad_names_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let authority = made(directory.path());
    authority.client("desk", guard(), &[HERE.into()], NOW_S).unwrap();
    assert!(authority.revoke("desk").unwrap() && !authority.revoke("desk").unwrap());
    assert_eq!(authority.clients().unwrap().role("desk"), None);
    for name in ["", "a/b", "*", "ca", "..", "a b", "sereno-1", "an-endlessly-long-name-of-a-client"] {
        assert!(authority.client(name, guard(), &[HERE.into()], NOW_S).is_err(), "{name}");
    }
    for endpoint in ["tcp/127.0.0.1:7447", ""] {
        assert!(authority.client("desk", guard(), &[endpoint.into()], NOW_S).is_err(), "{endpoint}");
    }
    assert!(authority.drone("sereno-3", &["no host".into()], NOW_S).is_err());
}
