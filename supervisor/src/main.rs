//! The supervisor process.

use std::process::ExitCode;

fn main() -> ExitCode {
    let result =
        supervisor::parse_arguments(std::env::args().skip(1)).and_then(|options| supervisor::run(&options));
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sereno-supervisor: {error}");
            ExitCode::FAILURE
        }
    }
}
