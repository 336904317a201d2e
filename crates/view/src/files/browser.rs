//! The program of the system that opens an address.

use std::process::{Command, Stdio};

/// Opens `url`; it holds nothing but an address of this machine and hexadecimal digits.
///
/// # Errors
/// There is no such program.
pub(super) fn open(url: &str) -> std::io::Result<()> {
    let (program, arguments): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("explorer", &[]),
        _ => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command.args(arguments).arg(url);
    let streams = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = streams.spawn()?;
    // Waited for, so that it does not stay behind as a zombie.
    std::thread::spawn(move || child.wait());
    Ok(())
}
