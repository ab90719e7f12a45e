//! What the tests of the whole system share.

pub mod counting;

use std::path::{Path, PathBuf};

/// The root of the checkout that these tests belong to.
#[must_use]
pub fn checkout() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Where `cargo build --release --bins` puts the programs of the system, as `cargo xtask test` does before it runs the tests.
#[must_use]
pub fn programs() -> PathBuf {
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| checkout().join("target"), PathBuf::from);
    target.join("release")
}

/// Copies `deploy/` to `directory` with another plan and its world: their names without an ending.
///
/// # Errors
/// What reading and writing files reports.
pub fn deploy_with(directory: &Path, building: &str) -> std::io::Result<PathBuf> {
    let copy = directory.join("deploy");
    for folder in ["config", "plans", "vehicles", "worlds"] {
        std::fs::create_dir_all(copy.join(folder))?;
        for entry in std::fs::read_dir(checkout().join("deploy").join(folder))? {
            let entry = entry?;
            std::fs::copy(entry.path(), copy.join(folder).join(entry.file_name()))?;
        }
    }
    for file in ["system.toml", "sim.toml"] {
        let text = std::fs::read_to_string(checkout().join("deploy").join(file))?;
        let text = text.replace("plans/demo.yaml", &format!("plans/{building}.yaml"));
        std::fs::write(
            copy.join(file),
            text.replace("worlds/demo.toml", &format!("worlds/{building}.toml")),
        )?;
    }
    Ok(copy)
}
