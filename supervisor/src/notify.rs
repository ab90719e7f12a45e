//! Plain `sd_notify`: datagrams of `KEY=VALUE` lines on a Unix socket, the sender's process id attested by the
//! kernel.

use crate::error::{SupervisorError, while_doing};
use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg, sockopt};
use std::io::IoSliceMut;
use std::mem::MaybeUninit;
use std::os::unix::net::UnixDatagram;
use std::path::Path;

/// Longest datagram: systemd's own bound.
const DATAGRAM: usize = 4096;

/// What a service said.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Notification {
    /// `READY=1`.
    pub(crate) ready: bool,
    /// `WATCHDOG=1`.
    pub(crate) beat: bool,
    /// `STATUS=...`.
    pub(crate) status: Option<String>,
    /// `X_MISSED=...`: deadlines missed since start.
    pub(crate) missed: Option<u64>,
    /// `STOPPING=1`.
    pub(crate) stopping: bool,
}

impl Notification {
    /// Unknown keys are somebody else's; bytes that are no text say nothing.
    fn parse(bytes: &[u8]) -> Self {
        let mut said = Self::default();
        for line in std::str::from_utf8(bytes).unwrap_or("").lines() {
            match line.split_once('=') {
                Some(("READY", "1")) => said.ready = true,
                Some(("WATCHDOG", "1")) => said.beat = true,
                Some(("STOPPING", "1")) => said.stopping = true,
                Some(("X_MISSED", count)) => said.missed = count.parse().ok(),
                Some(("STATUS", text)) => said.status = Some(text.chars().take(200).collect()),
                _ => {}
            }
        }
        said
    }
}

/// The socket that services notify.
#[derive(Debug)]
pub(crate) struct NotifySocket {
    pub(crate) socket: UnixDatagram,
}

impl NotifySocket {
    pub(crate) fn bind(path: &Path) -> Result<Self, SupervisorError> {
        let doing = || format!("notification socket {}", path.display());
        let socket = UnixDatagram::bind(path).map_err(while_doing(doing()))?;
        socket.set_nonblocking(true).map_err(while_doing(doing()))?;
        sockopt::set_socket_passcred(&socket, true).map_err(while_doing(doing()))?;
        Ok(Self { socket })
    }

    /// The next datagram and the process that sent it.
    pub(crate) fn receive(&self) -> Option<(u32, Notification)> {
        loop {
            let mut bytes = [0_u8; DATAGRAM];
            let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmCredentials(1))];
            let mut control = RecvAncillaryBuffer::new(&mut space);
            let mut io = [IoSliceMut::new(&mut bytes)];
            let received =
                recvmsg(&self.socket, &mut io, &mut control, RecvFlags::DONTWAIT | RecvFlags::CMSG_CLOEXEC)
                    .ok()?;
            let sender = control.drain().find_map(|message| match message {
                RecvAncillaryMessage::ScmCredentials(credentials) => Some(credentials.pid),
                _ => None,
            });
            // Without credentials nobody knows whose words these are.
            if let Some(pid) = sender {
                let length = received.bytes.min(DATAGRAM);
                return Some((pid.as_raw_pid().cast_unsigned(), Notification::parse(&bytes[..length])));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sender_is_attested() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("notify");
        let socket = NotifySocket::bind(&path).unwrap();
        assert_eq!(socket.receive(), None);
        let sender = UnixDatagram::unbound().unwrap();
        sender.send_to(b"READY=1\nX_MISSED=7\nSTATUS=at work\nMAINPID=1", &path).unwrap();
        let (pid, said) = socket.receive().unwrap();
        assert_eq!(pid, std::process::id());
        let wanted = Notification {
            ready: true,
            missed: Some(7),
            status: Some("at work".to_owned()),
            ..Default::default()
        };
        assert_eq!(said, wanted);
        assert_eq!(socket.receive(), None);
    }

    #[test]
    fn nonsense_says_nothing() {
        for bytes in
            [&b""[..], b"\xff\xff", b"READY", b"READY=0", b"=", b"WATCHDOG=trigger\n\n\n", b"X_MISSED=-1"]
        {
            assert_eq!(Notification::parse(bytes), Notification::default());
        }
        assert!(Notification::parse(b"WATCHDOG=1").beat && Notification::parse(b"STOPPING=1").stopping);
    }
}
