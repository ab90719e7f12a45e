//! `sereno schema`.

use anyhow::Result;
use std::process::ExitCode;

/// Prints the JSON schema of every topic.
pub(crate) fn run() -> Result<ExitCode> {
    println!("{}", serde_json::to_string_pretty(&bridge::schema::topics())?);
    Ok(ExitCode::SUCCESS)
}
