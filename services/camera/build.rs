//! The encoder's assembler parts need `nasm`; without it the build goes on silently with an encoder four times as slow.

use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=PATH");
    let target = std::env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
    let wanted = matches!(target.as_str(), "x86_64" | "x86");
    let found = Command::new("nasm").arg("-v").output().is_ok_and(|output| output.status.success());
    if wanted && !found {
        println!(
            "cargo::warning=nasm is not installed: encoding a frame takes about four times as long (7 ms in place of 2 at \
             640x480); install it (Debian: apt-get install nasm), then `cargo clean -p openh264-sys2` and build again"
        );
    }
    println!("cargo::rustc-env=CAMERA_ASSEMBLER={}", if !wanted || found { "yes" } else { "no" });
}
