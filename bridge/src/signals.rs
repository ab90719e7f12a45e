//! Messages of video sessions, in and out: carried, not understood.

use crate::keys::{Direction, Keys};
use crate::network::{Network, Pace};
use crate::roles::{Role, is_name};
use ipc_types::{Message, SignalIn, SignalOut};
use runtime::{Input, Output, Ports, StartError};
use std::sync::Arc;
use zenoh::bytes::Encoding;

/// The ports of video sessions.
pub(crate) struct Signals {
    input: Output<SignalIn>,
    output: Input<SignalOut>,
    keys: Keys,
}

impl Signals {
    /// `None` when the manifest has no video.
    pub(crate) fn open(ports: &mut Ports, keys: Keys) -> Result<Option<Self>, StartError> {
        let has = ports.may_publish(SignalIn::TOPIC)
            && ports.readable().iter().any(|topic| topic == SignalOut::TOPIC);
        if !has {
            return Ok(None);
        }
        Ok(Some(Self { input: ports.output()?, output: ports.input()?, keys }))
    }

    /// Hands on what a viewer says; false when it is no text or there is no place for it.
    pub(crate) fn hear(&mut self, certificate: &str, session: &str, role: Role, json: &[u8]) -> bool {
        let Some(text) = std::str::from_utf8(json).ok().filter(|_| is_name(session)) else { return false };
        let Some(mut loan) = self.input.loan() else { return false };
        loan.session.set(session);
        loan.certificate.set(certificate);
        loan.account.set(certificate);
        loan.role.set(role.word());
        loan.body.set(text);
        loan.send();
        true
    }

    /// Sends what the drone says to each viewer.
    pub(crate) fn pass(&mut self, network: &Network) {
        while let Some(signal) = self.output.receive() {
            let (certificate, session) = (signal.certificate.as_str(), signal.session.as_str());
            if is_name(certificate) && is_name(session) {
                let key: Arc<str> = self.keys.signal(certificate, session, Direction::Out).into();
                let body = signal.body.as_str().as_bytes().to_vec();
                network.put(&key, &Encoding::APPLICATION_JSON, body, Pace::Reliable);
            }
        }
    }
}
