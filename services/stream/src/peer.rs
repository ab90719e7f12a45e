//! One connection to a browser: made, described, and fed with packets.

use crate::feedback::{KeyRequests, SLOT};
use crate::rate::Report;
use crate::reports::{self, Reports};
use crate::{Candidate, Mode, StreamConfig};
use bytes::Bytes;
use rtc::interceptor::Slot;
use rtc::media_stream::MediaStreamTrack;
use rtc::peer_connection::configuration::media_engine::{MIME_TYPE_H264, MIME_TYPE_RTX};
use rtc::peer_connection::transport::RTCIceCandidatePair;
use rtc::rtp::codec::h264::H264Payloader;
use rtc::rtp::packetizer::Payloader;
use rtc::rtp::{Header, Packet};
use rtc::rtp_transceiver::rtp_sender::{
    RTCPFeedback, RTCRtpCodec, RTCRtpCodecParameters, RTCRtpCodingParameters, RTCRtpEncodingParameters,
    RTCRtpHeaderExtensionCapability, RTCRtpRtxParameters, RtpCodecKind,
};
use std::sync::Arc;
use tokio::sync::{mpsc, watch};
use webrtc::error::Error;
use webrtc::media_stream::track_local::static_rtp::TrackLocalStaticRTP;
use webrtc::media_stream::track_local::{TrackLocal, TrackLocalEvent};
use webrtc::peer_connection::{
    MediaEngine, PeerConnection, PeerConnectionBuilder, PeerConnectionEventHandler, RTCConfigurationBuilder,
    RTCIceCandidateInit, RTCIceCandidateType, RTCIceServer, RTCIceTransportPolicy, RTCPeerConnectionIceEvent,
    RTCPeerConnectionState, RTCSessionDescription, Registry, SettingEngineBuilder,
    register_default_interceptors,
};
use webrtc::rtp_transceiver::RtpSender;

/// What constrained baseline is called in a session description (RFC 6184).
const FMTP: &str = "level-asymmetry-allowed=1;packetization-mode=1;profile-level-id=42e01f";
const H264: u8 = 102;
const RTX: u8 = 103;
/// Ticks a second of video's clock in RTP.
const CLOCK_HZ: u64 = 90_000;
/// Bytes of payload in a packet: fits with all headers into the 1280 bytes that every IPv6 line carries.
const PAYLOAD: usize = 1120;
/// Least and most delay of the playout, 12 bits each: none.
const AT_ONCE: Bytes = Bytes::from_static(&[0; 3]);
const PLAYOUT_DELAY: &str = "http://www.webrtc.org/experiments/rtp-hdrext/playout-delay";

/// What a connection tells its session.
#[derive(Debug)]
pub(crate) enum Event {
    Candidate(Candidate),
    State(RTCPeerConnectionState),
}

struct Handler(mpsc::Sender<Event>);

#[async_trait::async_trait]
impl PeerConnectionEventHandler for Handler {
    async fn on_ice_candidate(&self, event: RTCPeerConnectionIceEvent) {
        if let Ok(init) = event.candidate.to_json() {
            let candidate = Candidate {
                candidate: init.candidate,
                sdp_mid: init.sdp_mid.or_else(|| Some("0".to_owned())),
                sdp_m_line_index: init.sdp_mline_index.or(Some(0)),
                username_fragment: init.username_fragment,
            };
            let _ = self.0.send(Event::Candidate(candidate)).await;
        }
    }

    async fn on_connection_state_change(&self, state: RTCPeerConnectionState) {
        let _ = self.0.send(Event::State(state)).await;
    }
}

/// A connection that sends one video.
pub(crate) struct Peer {
    connection: Arc<dyn PeerConnection>,
    track: Arc<TrackLocalStaticRTP>,
    sender: Arc<dyn RtpSender>,
    payloader: H264Payloader,
    ssrc: u32,
    sequence: u16,
    /// Number of the codec as negotiated; `None` before.
    payload_type: Option<u8>,
    /// Number of the playout delay as negotiated; `None` for a browser that does not know it.
    playout_delay: Option<u8>,
    mode: Mode,
    /// Relays that the viewer has named; as many as a session may name candidates.
    relays: Vec<(String, u16)>,
}

impl Peer {
    /// Sets a connection up. `number` gives it its stream numbers; `reports` gets what the viewer says of its line.
    pub(crate) async fn new(
        config: &StreamConfig,
        mode: Mode,
        number: u64,
        events: mpsc::Sender<Event>,
        reports: watch::Sender<Option<Report>>,
    ) -> Result<Self, Error> {
        let mut media = MediaEngine::default();
        for (mime, fmtp, payload_type) in
            [(MIME_TYPE_H264, FMTP.to_owned(), H264), (MIME_TYPE_RTX, format!("apt={H264}"), RTX)]
        {
            media.register_codec(codec(mime, fmtp, payload_type), RtpCodecKind::Video)?;
        }
        media.register_header_extension(
            RTCRtpHeaderExtensionCapability { uri: PLAYOUT_DELAY.to_owned() },
            RtpCodecKind::Video,
            None,
        )?;
        let registry = register_default_interceptors(Registry::new(), &mut media)?;
        let ssrc = (runtime::mix_seed(number, 1) as u32) | 1;
        let registry = registry
            .with(Slot::from(SLOT), KeyRequests::default())
            .with(Slot::from(reports::SLOT), Reports::new(ssrc, reports));
        let servers = config.servers.iter().map(|server| RTCIceServer {
            urls: server.urls.clone(),
            username: server.username.clone(),
            credential: server.credential.clone(),
        });
        let policy =
            if config.relay_only { RTCIceTransportPolicy::Relay } else { RTCIceTransportPolicy::All };
        // Names of the multicast kind need a network, which a drone that has just been switched on does not have yet.
        let settings = SettingEngineBuilder::new()
            .with_multicast_dns_mode(rtc::ice::mdns::MulticastDnsMode::Disabled)
            .with_include_loopback_candidate(true)
            .build();
        let sockets: Vec<String> = config
            .addresses
            .iter()
            .map(|address| std::net::SocketAddr::new(*address, 0).to_string())
            .collect();
        let connection = PeerConnectionBuilder::new()
            .with_configuration(
                RTCConfigurationBuilder::new()
                    .with_ice_servers(servers.collect())
                    .with_ice_transport_policy(policy)
                    .build(),
            )
            .with_media_engine(media)
            .with_interceptor_registry(registry)
            .with_setting_engine(settings)
            .with_handler(Arc::new(Handler(events)))
            .with_udp_addrs(if config.udp { sockets.clone() } else { Vec::new() })
            .with_tcp_addrs(if config.tcp { sockets } else { Vec::new() })
            .build()
            .await?;
        let connection: Arc<dyn PeerConnection> = Arc::new(connection);
        let track = Arc::new(TrackLocalStaticRTP::new(MediaStreamTrack::new(
            "drone".to_owned(),
            "camera".to_owned(),
            "camera".to_owned(),
            RtpCodecKind::Video,
            vec![RTCRtpEncodingParameters {
                rtp_coding_parameters: RTCRtpCodingParameters {
                    ssrc: Some(ssrc),
                    rtx: Some(RTCRtpRtxParameters { ssrc: ssrc ^ 0x5555_5554 }),
                    ..Default::default()
                },
                codec: codec(MIME_TYPE_H264, FMTP.to_owned(), H264).rtp_codec,
                ..Default::default()
            }],
        )));
        let sender = connection.add_track(Arc::clone(&track) as Arc<dyn TrackLocal>).await?;
        Ok(Self {
            connection,
            track,
            sender,
            payloader: H264Payloader::default(),
            ssrc,
            sequence: runtime::mix_seed(number, 2) as u16,
            payload_type: None,
            playout_delay: None,
            mode,
            relays: Vec::new(),
        })
    }

    /// The drone's offer.
    pub(crate) async fn offer(&self) -> Result<String, Error> {
        let offer = self.connection.create_offer(None).await?;
        self.connection.set_local_description(offer.clone()).await?;
        Ok(offer.sdp)
    }

    /// Takes the viewer's answer.
    pub(crate) async fn answer(&mut self, sdp: String) -> Result<(), Error> {
        let answer = RTCSessionDescription::answer(sdp)?;
        self.connection.set_remote_description(answer).await?;
        let negotiated = self.sender.get_parameters().await?.rtp_parameters;
        let mut codecs = negotiated.codecs.iter();
        let codec = codecs.find(|codec| codec.rtp_codec.mime_type.eq_ignore_ascii_case(MIME_TYPE_H264));
        self.payload_type = codec.map(|codec| codec.payload_type);
        let mut extensions = negotiated.header_extensions.iter();
        let delay = extensions.find(|extension| extension.uri == PLAYOUT_DELAY);
        self.playout_delay = delay.and_then(|extension| u8::try_from(extension.id).ok());
        if self.payload_type.is_none() {
            return Err(Error::Other("the browser has no decoder for H.264 constrained baseline".to_owned()));
        }
        Ok(())
    }

    /// Takes one more way to reach the viewer.
    pub(crate) async fn candidate(&mut self, candidate: Candidate) -> Result<(), Error> {
        self.relays.extend(relay_in(&candidate.candidate));
        let init = RTCIceCandidateInit {
            candidate: candidate.candidate,
            sdp_mid: candidate.sdp_mid,
            sdp_mline_index: candidate.sdp_m_line_index,
            username_fragment: candidate.username_fragment,
            url: None,
        };
        self.connection.add_ice_candidate(init).await
    }

    /// Sends an access unit.
    pub(crate) async fn send(&mut self, unit: &Bytes, capture_ns: u64) -> Result<(), Error> {
        let Some(payload_type) = self.payload_type else { return Ok(()) };
        let timestamp = (u128::from(capture_ns) * u128::from(CLOCK_HZ) / 1_000_000_000) as u32;
        let payloads = self.payloader.payload(PAYLOAD, unit)?;
        let last = payloads.len();
        for (index, payload) in payloads.into_iter().enumerate() {
            self.sequence = self.sequence.wrapping_add(1);
            let mut header = Header {
                version: 2,
                marker: index + 1 == last,
                payload_type,
                sequence_number: self.sequence,
                timestamp,
                ssrc: self.ssrc,
                ..Default::default()
            };
            if let (Mode::Pilot, Some(id)) = (self.mode, self.playout_delay) {
                header.set_extension(id, AT_ONCE)?;
            }
            self.track.write_rtp(Packet { header, payload }).await?;
        }
        Ok(())
    }

    /// How the viewer watches from now on.
    pub(crate) fn set_mode(&mut self, mode: Mode) {
        self.mode = mode;
    }

    /// What delivers the viewer's requests for key frames.
    pub(crate) fn track(&self) -> Arc<TrackLocalStaticRTP> {
        Arc::clone(&self.track)
    }

    /// `udp`, `tcp` or `turn`; empty while none is chosen.
    pub(crate) async fn path(&self) -> String {
        let Ok(Some(transport)) = self.sender.transport().await else { return String::new() };
        let pair = transport.ice_transport().get_selected_candidate_pair().await;
        pair.ok().flatten().map_or_else(String::new, |pair| name_of(&pair, &self.relays))
    }

    pub(crate) async fn close(&self) {
        // What cannot be closed is gone already.
        let _ = self.connection.close().await;
    }
}

/// Waits until the viewer asks for a key frame; `false`: there will be no more.
pub(crate) async fn key_requested(track: &TrackLocalStaticRTP) -> bool {
    matches!(track.poll().await, Some(TrackLocalEvent::OnRtcpPacket(_)))
}

fn codec(mime: &str, fmtp: String, payload_type: u8) -> RTCRtpCodecParameters {
    let feedback = |typ: &str, parameter: &str| RTCPFeedback { typ: typ.into(), parameter: parameter.into() };
    RTCRtpCodecParameters {
        rtp_codec: RTCRtpCodec {
            mime_type: mime.to_owned(),
            clock_rate: CLOCK_HZ as u32,
            channels: 0,
            sdp_fmtp_line: fmtp,
            rtcp_feedback: if payload_type == RTX {
                Vec::new()
            } else {
                vec![feedback("nack", ""), feedback("nack", "pli"), feedback("ccm", "fir")]
            },
        },
        payload_type,
    }
}

/// Where a candidate's line says that a relay listens (RFC 8839, section 5.1); `None` for candidates of other kinds.
fn relay_in(line: &str) -> Option<(String, u16)> {
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let (address, port) = (words.get(4)?, words.get(5)?.parse().ok()?);
    words.windows(2).any(|pair| pair == ["typ", "relay"]).then(|| ((*address).to_owned(), port))
}

/// The name of a way: `turn` when either end is a relay, and its protocol otherwise. A relay whose packets came before its
/// candidate is known by its address alone, which is why `relays` are remembered.
fn name_of(pair: &RTCIceCandidatePair, relays: &[(String, u16)]) -> String {
    let (local, remote) = (pair.local(), pair.remote());
    let known = relays.iter().any(|(address, port)| *address == remote.address && *port == remote.port);
    if known || [local, remote].iter().any(|side| side.typ == RTCIceCandidateType::Relay) {
        "turn".to_owned()
    } else {
        local.protocol.to_string().to_lowercase()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use webrtc::peer_connection::RTCIceCandidate;

    #[test]
    fn a_relay_is_known_by_its_candidate_and_later_by_its_address() {
        let line = "candidate:1 1 udp 41885439 192.0.2.7 49152 typ relay raddr 0.0.0.0 rport 0 generation 0";
        let relay = relay_in(line).unwrap();
        assert_eq!(relay, ("192.0.2.7".to_owned(), 49152));
        for other in
            ["", "candidate:1 1 udp 1 192.0.2.7 49152 typ host", "a b c d e f typ relay", "typ relay"]
        {
            assert_eq!(relay_in(other), None, "{other}");
        }
        let side = |typ, port| RTCIceCandidate {
            address: "192.0.2.7".to_owned(),
            port,
            typ,
            ..RTCIceCandidate::default()
        };
        let host = || side(RTCIceCandidateType::Host, 1);
        let name = |remote| name_of(&RTCIceCandidatePair::new(host(), remote), std::slice::from_ref(&relay));
        assert_eq!(name(side(RTCIceCandidateType::Prflx, 49152)), "turn");
        assert_eq!(name(side(RTCIceCandidateType::Relay, 9)), "turn");
        assert_ne!(name(side(RTCIceCandidateType::Prflx, 9)), "turn");
    }
}
