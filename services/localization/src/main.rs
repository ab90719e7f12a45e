//! The localization process.

fn main() -> std::process::ExitCode {
    runtime::main::<localization::Localization>(runtime::NoDevices)
}
