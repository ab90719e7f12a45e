//! Making this machine's browsers trust the drone's authority, and no longer.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A program with its arguments.
type Step = Vec<String>;

/// What is there on this machine.
#[derive(Debug, Clone, Default)]
pub(crate) struct Machine {
    /// `update-ca-certificates` (Debian and its kin).
    debian: bool,
    /// `trust` of p11-kit (Fedora, Arch and their kin).
    p11: bool,
    /// `certutil` and the user's own store, which Chromium reads instead of the system's.
    nss: Option<PathBuf>,
}

impl Machine {
    /// Looks around.
    pub(crate) fn look() -> Self {
        let has = |program: &str| {
            let paths = std::env::var_os("PATH").unwrap_or_default();
            let mut places: Vec<PathBuf> = std::env::split_paths(&paths).collect();
            places.extend([PathBuf::from("/usr/sbin"), PathBuf::from("/sbin")]);
            places.iter().any(|place| place.join(program).is_file())
        };
        let store = std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".pki/nssdb"));
        Self {
            debian: has("update-ca-certificates"),
            p11: has("trust"),
            nss: store.filter(|store| has("certutil") && store.is_dir()),
        }
    }

    /// What has to be run so that the authority in `ca`, called `name`, is trusted, or no longer.
    pub(crate) fn steps(&self, ca: &Path, name: &str, trust: bool) -> Vec<Step> {
        let ca = ca.display().to_string();
        let step = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Step>();
        let mut steps = Vec::new();
        if self.debian {
            let file = format!("/usr/local/share/ca-certificates/{}.crt", name.replace(' ', "-"));
            if trust {
                steps.push(step(&["install", "-m", "644", &ca, &file]));
                steps.push(step(&["update-ca-certificates"]));
            } else {
                steps.push(step(&["rm", "-f", &file]));
                steps.push(step(&["update-ca-certificates", "--fresh"]));
            }
        } else if self.p11 {
            let how = if trust { "--store" } else { "--remove" };
            steps.push(step(&["trust", "anchor", how, &ca]));
        }
        if let Some(store) = &self.nss {
            let store = format!("sql:{}", store.display());
            if trust {
                steps.push(step(&["certutil", "-d", &store, "-A", "-t", "C,,", "-n", name, "-i", &ca]));
            } else {
                steps.push(step(&["certutil", "-d", &store, "-D", "-n", name]));
            }
        }
        steps
    }
}

/// A step as a person would type it.
fn shown(step: &Step) -> String {
    let quoted = step.iter().map(|word| if word.contains(' ') { format!("'{word}'") } else { word.clone() });
    quoted.collect::<Vec<_>>().join(" ")
}

/// Runs the steps, or prints them for somebody who may.
pub(crate) fn run(ca: &Path, name: &str, trust: bool, print: bool) -> Result<()> {
    let steps = Machine::look().steps(ca, name, trust);
    if steps.is_empty() {
        bail!(
            "this machine has no update-ca-certificates, trust or certutil: {} {} by hand in the browser's settings, \
             under certificates, authorities",
            if trust { "add" } else { "remove" },
            ca.display()
        );
    }
    for step in &steps {
        if print {
            println!("{}", shown(step));
            continue;
        }
        let Some((program, arguments)) = step.split_first() else { continue };
        let output = Command::new(program)
            .args(arguments)
            .output()
            .with_context(|| format!("cannot run {program}"))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
            let all: Vec<String> = steps.iter().map(shown).collect();
            bail!("{}: {said}; run these as root: {}", shown(step), all.join(" && "));
        }
        println!("done: {}", shown(step));
    }
    Ok(())
}

/// A QR code for a terminal, of the address where a console tells devices how to trust it.
pub(crate) fn code(address: &str) -> Result<String> {
    if !address.starts_with("https://") || address.len() > 300 || address.contains(char::is_whitespace) {
        bail!("--qr {address}: allowed is an address that begins with https://, at most 300 bytes");
    }
    let code = qrcode::QrCode::new(address).context("this address makes no QR code")?;
    let mut picture = code.render::<qrcode::render::unicode::Dense1x2>();
    // Terminals are dark as a rule, and cameras want the code dark on light.
    let (dark, light) = (qrcode::render::unicode::Dense1x2::Light, qrcode::render::unicode::Dense1x2::Dark);
    Ok(format!("{}\n", picture.dark_color(dark).light_color(light).build()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_added_is_what_is_removed() {
        let all = Machine { debian: true, p11: true, nss: Some(PathBuf::from("/home/ana/.pki/nssdb")) };
        let steps = |trust| {
            all.steps(Path::new("/c/ca.pem"), "Sereno x 12", trust).iter().map(shown).collect::<Vec<_>>()
        };
        assert_eq!(
            steps(true),
            [
                "install -m 644 /c/ca.pem /usr/local/share/ca-certificates/Sereno-x-12.crt",
                "update-ca-certificates",
                "certutil -d sql:/home/ana/.pki/nssdb -A -t C,, -n 'Sereno x 12' -i /c/ca.pem",
            ]
        );
        assert_eq!(
            steps(false),
            [
                "rm -f /usr/local/share/ca-certificates/Sereno-x-12.crt",
                "update-ca-certificates --fresh",
                "certutil -d sql:/home/ana/.pki/nssdb -D -n 'Sereno x 12'",
            ]
        );
        for wrong in ["", "http://a/trust", "https://a b", &format!("https://{}", "a".repeat(300))] {
            assert!(code(wrong).is_err(), "{wrong}");
        }
        assert!(code("https://drone.local/trust").is_ok_and(|code| code.lines().count() > 12));
        assert!(Machine::default().steps(Path::new("ca.pem"), "x", true).is_empty());
    }
}
