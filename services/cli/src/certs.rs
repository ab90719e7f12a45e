//! `sereno certs`: the owner's certificates.

use crate::trust;
use anyhow::{Result, bail};
use bridge::Authority;
use bridge::roles::Standing;
use clap::{Args, Subcommand};
use cli::place::Place;
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{SystemTime, UNIX_EPOCH};

#[derive(Debug, Args)]
pub(crate) struct Certs {
    /// Directory of the certificates; `certs` beside system.toml when absent.
    #[arg(long, global = true, env = "SERENO_CERTS")]
    certs: Option<PathBuf>,
    #[command(subcommand)]
    order: CertsOrder,
}

#[derive(Debug, Subcommand)]
enum CertsOrder {
    /// Make the authority, the drone's identity, the console's and its page's; what is there stays as it is.
    Init {
        /// A name or address by which drone and console are reached from other machines; may be repeated.
        #[arg(long = "host")]
        hosts: Vec<String>,
        /// Name of the drone; that of system.toml when absent; may be repeated.
        #[arg(long = "name")]
        names: Vec<String>,
        /// Where the console finds the drones.
        #[arg(long = "endpoint")]
        endpoints: Vec<String>,
    },
    /// Make the identity of one more drone (or a new one, for other hosts).
    Drone {
        name: String,
        /// A name or address by which it is reached from other machines; may be repeated.
        #[arg(long = "host")]
        hosts: Vec<String>,
    },
    /// Make all that a program on another machine needs, in one directory to be carried there.
    Client {
        name: String,
        /// viewer, guard, installer or administrator.
        #[arg(long)]
        role: String,
        /// Where it finds the drone: tls/HOST:PORT; may be repeated for several drones.
        #[arg(long = "endpoint")]
        endpoints: Vec<String>,
    },
    /// Make the configuration of a zenoh router that checks certificates as the drone does.
    Router {
        name: String,
        /// Where it listens: tls/HOST:PORT; may be repeated.
        #[arg(long = "endpoint", required = true)]
        endpoints: Vec<String>,
    },
    /// Take a certificate off the drone's list: it may nothing from then on.
    Revoke { name: String },
    /// Make every certificate again that ends within 60 days.
    Renew {
        /// Every one, whenever it ends.
        #[arg(long)]
        all: bool,
    },
    /// Show names, roles and when each certificate ends.
    List,
    /// Make the console's certificate for browsers again, for this machine and these hosts.
    ServerNames { hosts: Vec<String> },
    /// Let this machine's browsers trust the authority.
    Trust {
        /// Only print what to run.
        #[arg(long)]
        print: bool,
        /// Trust nothing here; print a QR code that leads a phone to this address: https://HOST/trust of the console.
        #[arg(long, value_name = "ADDRESS", conflicts_with = "print")]
        qr: Option<String>,
    },
    /// Print the authority's SHA-256 in sixteen groups, to be compared with what a phone or browser is shown at /trust.
    Fingerprint,
    /// No longer.
    Untrust {
        /// Only print what to run.
        #[arg(long)]
        print: bool,
    },
}

fn now_s() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs().cast_signed()
}

/// Where the drone is found when nobody says it: by the first of its certificate's names that is not this machine's own.
fn endpoints(authority: &Authority, given: &[String]) -> Result<Vec<String>> {
    if !given.is_empty() {
        return Ok(given.to_vec());
    }
    let mut found = Vec::new();
    for listed in authority.list().unwrap_or_default().iter().filter(|listed| listed.standing == "drone") {
        let text = std::fs::read_to_string(&listed.file)?;
        let facts =
            bridge::x509::facts(&listed.file.display().to_string(), &text).map_err(anyhow::Error::msg)?;
        let own = ["localhost", "127.0.0.1", "::1"];
        found.extend(facts.hosts.iter().find(|host| !own.contains(&host.as_str())).map(|host| {
            let host = if host.contains(':') { format!("[{host}]") } else { host.clone() };
            format!("tls/{host}:7447")
        }));
    }
    if found.is_empty() {
        found.push("tls/127.0.0.1:7447".to_owned());
    }
    Ok(found)
}

/// The authority's own certificate: its file and what is in it.
fn certificate(authority: &Authority) -> Result<(PathBuf, String)> {
    let ca = authority.directory().join("ca.pem");
    let text = std::fs::read_to_string(&ca).map_err(|error| {
        anyhow::anyhow!("cannot read {}: {error}: `sereno certs init` makes it", ca.display())
    })?;
    Ok((ca, text))
}

pub(crate) fn run(place: &Place, certs: &Certs, json: bool) -> Result<ExitCode> {
    let directory = match &certs.certs {
        Some(directory) => directory.clone(),
        None => place.deploy()?.join("certs"),
    };
    let authority = Authority::at(std::path::absolute(directory)?);
    let now = now_s();
    let mut said = Vec::new();
    match &certs.order {
        CertsOrder::Init { hosts, names, endpoints: given } => {
            let names =
                if names.is_empty() { vec![place.manifest(false)?.0.system.name] } else { names.clone() };
            let given = match (given.as_slice(), hosts.first()) {
                ([], Some(host)) => vec![format!("tls/{host}:7447")],
                ([], None) => vec!["tls/127.0.0.1:7447".to_owned()],
                (given, _) => given.to_vec(),
            };
            authority.init(&names, hosts, &given, now)?;
            said.push(format!("certificates of {} in {}", names.join(", "), authority.directory().display()));
        }
        CertsOrder::Drone { name, hosts } => {
            authority.drone(name, hosts, now)?;
            said.push(format!("{name}: identity of a drone in {}", authority.directory().display()));
        }
        CertsOrder::Client { name, role, endpoints: given } => {
            let Some(standing @ Standing::Client(_)) = Standing::from_word(role) else {
                bail!("--role {role}: allowed are viewer, guard, installer, administrator");
            };
            let directory = authority.client(name, standing, &endpoints(&authority, given)?, now)?;
            said.push(format!("{name} is {role}; carry {} to its machine", directory.display()));
        }
        CertsOrder::Router { name, endpoints } => {
            let directory = authority.client(name, Standing::Router, endpoints, now)?;
            said.push(format!(
                "{name} is a router: ZENOH_RUNTIME='{}' zenohd --config {}",
                bridge::threads::ONE_THREAD,
                directory.join(format!("{name}.json5")).display()
            ));
        }
        CertsOrder::Revoke { name } => {
            if !authority.revoke(name)? {
                bail!("{name} is not on the list");
            }
            said.push(format!("{name} may nothing any more"));
        }
        CertsOrder::Renew { all } => {
            let renewed = authority.renew(*all, now)?;
            said.push(if renewed.is_empty() {
                "nothing ends within 60 days".to_owned()
            } else {
                format!(
                    "made again: {}; carry the directories of clients to their machines",
                    renewed.join(", ")
                )
            });
        }
        CertsOrder::List => {
            for listed in authority.list()? {
                let days = (listed.not_after_s - now).div_euclid(86_400);
                if json {
                    let row = json!({ "name": listed.name, "role": listed.standing, "days_left": days,
                        "not_after_s": listed.not_after_s, "file": listed.file });
                    println!("{row}");
                } else {
                    let ends = if days < 0 {
                        format!("ended {} days ago", -days)
                    } else {
                        format!("{days} days left")
                    };
                    println!(
                        "{:<24} {:<14} {ends:<20} {}",
                        listed.name,
                        listed.standing,
                        listed.file.display()
                    );
                }
            }
            return Ok(ExitCode::SUCCESS);
        }
        CertsOrder::ServerNames { hosts } => {
            authority.page(hosts, now)?;
            said.push(format!("the page's certificate is for localhost, 127.0.0.1, ::1 {}", hosts.join(" ")));
        }
        CertsOrder::Fingerprint => {
            let (_, text) = certificate(&authority)?;
            said.push(bridge::x509::fingerprint("ca.pem", &text).map_err(anyhow::Error::msg)?);
        }
        CertsOrder::Trust { qr: Some(address), .. } => {
            print!("{}", trust::code(address)?);
            let (_, text) = certificate(&authority)?;
            said.push(address.clone());
            said.push(bridge::x509::fingerprint("ca.pem", &text).map_err(anyhow::Error::msg)?);
        }
        CertsOrder::Trust { print, .. } | CertsOrder::Untrust { print } => {
            let (ca, text) = certificate(&authority)?;
            let facts = bridge::x509::facts(&ca.display().to_string(), &text).map_err(anyhow::Error::msg)?;
            trust::run(&ca, &facts.name, matches!(certs.order, CertsOrder::Trust { .. }), *print)?;
            return Ok(ExitCode::SUCCESS);
        }
    }
    for line in said {
        if json {
            println!("{}", json!({ "done": line }));
        } else {
            println!("{line}");
        }
    }
    Ok(ExitCode::SUCCESS)
}
