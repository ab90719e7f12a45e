//! Which building a drone has: so that a change made from an older one writes over nobody's work.

use crate::edit::LONGEST_ACCOUNT;
use crate::files::{read_text, write_public};
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The largest header or side file that is read, bytes: a building with all its corners takes a quarter.
const MAX_FILE: u64 = 1 << 20;

/// Who made the building that is in use, kept beside the side file.
#[derive(Debug, Serialize, Deserialize)]
struct Made {
    revision: String,
    account: String,
}

/// The files that say what the building is: the plan's header, which names its picture, and the side file.
#[derive(Debug, Clone)]
pub struct BuildingFiles {
    /// The plan's header.
    pub header: PathBuf,
    /// The side file; it need not be there.
    pub sidecar: PathBuf,
}

impl BuildingFiles {
    /// What tells this building from any other: 16 hexadecimal digits.
    ///
    /// # Errors
    /// One sentence naming the file that cannot be read.
    pub fn revision(&self) -> Result<String, String> {
        let mut bytes = Vec::new();
        for path in [&self.header, &self.sidecar] {
            let content = read(path)?;
            // With its length first: what moves from one file to the other is another building.
            bytes.extend_from_slice(&(content.len() as u64).to_le_bytes());
            bytes.extend_from_slice(&content);
        }
        Ok(format!("{:016x}", runtime::fnv(&bytes)))
    }

    /// Checks that a change was made from the building that is there now.
    ///
    /// # Errors
    /// A sentence that says who has changed it meanwhile, as far as that is known.
    pub fn check(&self, made_from: &str) -> Result<(), String> {
        let revision = self.revision()?;
        if revision == made_from {
            return Ok(());
        }
        let by = self.made_by(&revision).map_or_else(String::new, |account| format!(" by {account}"));
        Err(format!("the building was changed meanwhile{by}: load it anew"))
    }

    /// Keeps who made the building that is there now.
    ///
    /// # Errors
    /// One sentence naming the file that cannot be written.
    pub fn sign(&self, account: &str) -> Result<(), String> {
        let made = Made { revision: self.revision()?, account: account.to_owned() };
        let text = serde_json::to_vec(&made).map_err(|error| error.to_string())?;
        write_public(&self.signature(), &text)
    }

    /// Who made the building of a revision; `None` when it was not made over the network.
    fn made_by(&self, revision: &str) -> Option<String> {
        let made: Made = serde_json::from_str(&read_text(&self.signature()).ok()?).ok()?;
        let plain = !made.account.is_empty()
            && made.account.len() <= LONGEST_ACCOUNT
            && !made.account.chars().any(char::is_control);
        (made.revision == revision && plain).then_some(made.account)
    }

    fn signature(&self) -> PathBuf {
        let mut name = self.sidecar.file_name().unwrap_or_default().to_owned();
        name.push(".made");
        self.sidecar.with_file_name(name)
    }
}

/// The bytes of a file; none when it is not there.
fn read(path: &Path) -> Result<Vec<u8>, String> {
    let failed = |error: std::io::Error| format!("cannot read {}: {error}", path.display());
    match std::fs::metadata(path) {
        Ok(found) if found.len() > MAX_FILE => {
            Err(format!("{}: {} bytes: allowed are at most {MAX_FILE}", path.display(), found.len()))
        }
        Ok(_) => std::fs::read(path).map_err(failed),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(failed(error)),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn every_change_is_another_building_and_says_whose_it_is() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        let files = BuildingFiles { header: at("a.yaml"), sidecar: at("a.rooms.yaml") };
        let mut seen = vec![files.revision().unwrap()];
        for (name, text) in
            [("a.yaml", "image: a"), ("a.rooms.yaml", "b"), ("a.yaml", "image: ab"), ("a.rooms.yaml", "")]
        {
            std::fs::write(at(name), text).unwrap();
            let revision = files.revision().unwrap();
            assert!(!seen.contains(&revision), "{name}: {text}");
            seen.push(revision);
        }
        let newest = seen.pop().unwrap();
        files.check(&newest).unwrap();
        let said = files.check(&seen[0]).unwrap_err();
        assert_eq!(said, "the building was changed meanwhile: load it anew", "nobody is named");
        files.sign("eva@example.org").unwrap();
        files.check(&newest).unwrap();
        let said = files.check(&seen[0]).unwrap_err();
        assert_eq!(said, "the building was changed meanwhile by eva@example.org: load it anew");
        // What somebody wrote on the drone itself is not hers.
        std::fs::write(at("a.rooms.yaml"), "by hand").unwrap();
        assert_eq!(files.check(&newest).unwrap_err(), "the building was changed meanwhile: load it anew");
    }
}
