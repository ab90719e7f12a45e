//! What a viewer says in a video session.

use super::network::said;
use super::{text_memory, within_memory};
use stream::FromViewer;

/// One message of WebRTC's signalling, JSON.
///
/// What is no message is refused in one plain line. A call that is taken wants a picture that can be encoded, and nothing that is
/// taken is longer than its bound.
pub fn signal(data: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(data) else { return false };
    match within_memory(text_memory(text.len()), || FromViewer::parse(text)) {
        Err(sentence) => said(&sentence),
        Ok(message) => {
            match &message {
                FromViewer::Call(call) => {
                    let format = call.format();
                    assert!(format.is_valid(), "{format:?}");
                    assert!((300_000..=6_000_000).contains(&format.bitrate), "{format:?}");
                    assert!(call.account.len() <= 64);
                }
                FromViewer::Answer(answer) => assert!(answer.sdp.len() <= 16_384),
                FromViewer::Candidate(candidate) => assert!(candidate.candidate.len() <= 1024),
                FromViewer::HangUp(reason) => assert!(reason.reason.len() <= 256),
            }
            assert_eq!(FromViewer::parse(text), Ok(message));
            true
        }
    }
}
