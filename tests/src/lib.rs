//! What the tests of the whole system share.

pub mod counting;
pub mod fuzz;
#[cfg(feature = "services")]
pub mod scenarios;
#[cfg(feature = "services")]
pub mod streams;

use std::path::{Path, PathBuf};
use std::process::Command;

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

/// Copies `deploy/` to `directory` with another plan and its world (their names without an ending) and a free port for
/// the bridge.
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
    // Systems fly beside each other in tests, and only one of them can listen at the usual place.
    let bridge = copy.join("config/bridge.toml");
    let port = std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let text = std::fs::read_to_string(&bridge)?.replace("127.0.0.1:7447", &format!("127.0.0.1:{port}"));
    std::fs::write(&bridge, text)?;
    Ok(copy)
}

/// As [`deploy_with`], with light clutter in the simulator's configuration.
///
/// # Errors
/// What reading and writing files reports; also when the configuration says nothing of full clutter.
pub fn lightly_cluttered(directory: &Path, building: &str) -> std::io::Result<PathBuf> {
    let deploy = deploy_with(directory, building)?;
    let simulator = deploy.join("config/simulator.toml");
    let text = std::fs::read_to_string(&simulator)?;
    let lighter = text.replace("clutter = \"full\"", "clutter = \"light\"");
    if lighter == text {
        return Err(std::io::Error::other("no full clutter in simulator.toml"));
    }
    std::fs::write(&simulator, lighter)?;
    Ok(deploy)
}

/// Runs `sereno` over a deploy directory and returns what it printed.
///
/// # Panics
/// When it does not exit with zero: with what it said and its last lines.
#[must_use]
#[allow(clippy::panic, reason = "for tests")]
pub fn sereno(deploy: &Path, run_dir: &Path, arguments: &[&str]) -> String {
    let program = programs().join("sereno");
    let output = Command::new(&program)
        .arg("--deploy")
        .arg(deploy)
        .arg("--run-dir")
        .arg(run_dir)
        .args(arguments)
        .output()
        .unwrap_or_else(|error| panic!("{}: {error}; `cargo xtask test` builds it", program.display()));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success(),
        "sereno {}: {}\n{}\n{}",
        arguments.join(" "),
        output.status,
        String::from_utf8_lossy(&output.stderr),
        text.lines().rev().take(12).collect::<Vec<_>>().join("\n")
    );
    text
}
