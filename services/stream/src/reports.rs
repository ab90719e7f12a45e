//! Reads what viewers report of their line (RFC 3550, section 6.4): the library answers them and keeps them to itself.

use crate::rate::Report;
use rtc::interceptor::{Interceptor, Packet, StreamInfo, TaggedPacket};
use rtc::rtcp::receiver_report::ReceiverReport;
use rtc::rtcp::reception_report::ReceptionReport;
use rtc::rtcp::sender_report::SenderReport;
use rtc::sansio::Protocol;
use rtc::shared::error::Error;
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// Next to the wire: our own reports pass here as they leave, those of viewers as they come.
pub(crate) const SLOT: usize = 1_500;
/// Our reports that are remembered: one leaves a second, and an answer that is older says nothing of now.
const REMEMBERED: usize = 8;

/// Passes everything on, and tells what the reports about one stream say.
pub(crate) struct Reports {
    ssrc: u32,
    tell: watch::Sender<Option<Report>>,
    /// The middle of our reports' time stamps, by which the viewer names them, and when they left.
    sent: VecDeque<(u32, Instant)>,
    inbound: VecDeque<TaggedPacket>,
    outbound: VecDeque<TaggedPacket>,
}

impl Reports {
    pub(crate) fn new(ssrc: u32, tell: watch::Sender<Option<Report>>) -> Self {
        let (sent, inbound, outbound) = Default::default();
        Self { ssrc, tell, sent, inbound, outbound }
    }

    fn heard(&self, now: Instant, block: &ReceptionReport) {
        if block.ssrc != self.ssrc {
            return;
        }
        let asked = self
            .sent
            .iter()
            .find(|(stamp, _)| block.last_sender_report != 0 && *stamp == block.last_sender_report);
        let held = Duration::from_secs_f64(f64::from(block.delay) / 65_536.0);
        let round_trip = asked.map(|(_, left)| now.saturating_duration_since(*left).saturating_sub(held));
        let loss = f64::from(block.fraction_lost) / 256.0;
        self.tell.send_replace(Some(Report { loss, round_trip }));
    }
}

impl Protocol<TaggedPacket, TaggedPacket, ()> for Reports {
    type Rout = TaggedPacket;
    type Wout = TaggedPacket;
    type Eout = ();
    type Error = Error;
    type Time = Instant;

    fn handle_read(&mut self, message: TaggedPacket) -> Result<(), Error> {
        if let Packet::Rtcp(packets) = &message.message.packet {
            for packet in packets {
                let packet = packet.as_any();
                let blocks = packet
                    .downcast_ref::<ReceiverReport>()
                    .map(|report| &report.reports)
                    .or_else(|| packet.downcast_ref::<SenderReport>().map(|report| &report.reports));
                for block in blocks.into_iter().flatten() {
                    self.heard(message.now, block);
                }
            }
        }
        self.inbound.push_back(message);
        Ok(())
    }

    fn poll_read(&mut self) -> Option<TaggedPacket> {
        self.inbound.pop_front()
    }

    fn handle_write(&mut self, message: TaggedPacket) -> Result<(), Error> {
        if let Packet::Rtcp(packets) = &message.message.packet {
            for packet in packets {
                let report = packet.as_any().downcast_ref::<SenderReport>();
                if let Some(report) = report.filter(|report| report.ssrc == self.ssrc) {
                    if self.sent.len() >= REMEMBERED {
                        self.sent.pop_front();
                    }
                    self.sent.push_back(((report.ntp_time >> 16) as u32, message.now));
                }
            }
        }
        self.outbound.push_back(message);
        Ok(())
    }

    fn poll_write(&mut self) -> Option<TaggedPacket> {
        self.outbound.pop_front()
    }
}

impl Interceptor for Reports {
    fn bind_local_stream(&mut self, _info: &StreamInfo) {}
    fn unbind_local_stream(&mut self, _info: &StreamInfo) {}
    fn bind_remote_stream(&mut self, _info: &StreamInfo) {}
    fn unbind_remote_stream(&mut self, _info: &StreamInfo) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtc::interceptor::AttributedPacket;

    fn packet(now: Instant, rtcp: impl rtc::rtcp::Packet + 'static) -> TaggedPacket {
        TaggedPacket {
            now,
            transport: Default::default(),
            message: AttributedPacket::new(Packet::Rtcp(vec![Box::new(rtcp)])),
        }
    }

    #[test]
    fn losses_and_round_trip_come_out_of_a_report_that_names_ours() {
        let (tell, told) = watch::channel(None);
        let mut reports = Reports::new(7, tell);
        let began = Instant::now();
        let ours = SenderReport { ssrc: 7, ntp_time: 0x0123_4567_89ab_cdef, ..SenderReport::default() };
        reports.handle_write(packet(began, ours)).unwrap();
        assert!(reports.poll_write().is_some(), "it goes on");
        let block = |ssrc, last_sender_report| ReceptionReport {
            ssrc,
            fraction_lost: 64,
            last_sender_report,
            delay: 32_768,
            ..ReceptionReport::default()
        };
        let later = began + Duration::from_millis(530);
        let theirs = |blocks| ReceiverReport { reports: blocks, ..ReceiverReport::default() };
        reports.handle_read(packet(later, theirs(vec![block(8, 0x4567_89ab)]))).unwrap();
        assert_eq!(*told.borrow(), None, "of another stream");
        reports.handle_read(packet(later, theirs(vec![block(7, 0x4567_89ab)]))).unwrap();
        let report = Report { loss: 0.25, round_trip: Some(Duration::from_millis(30)) };
        assert_eq!(*told.borrow(), Some(report));
        reports.handle_read(packet(later, theirs(vec![block(7, 0)]))).unwrap();
        assert_eq!(*told.borrow(), Some(Report { round_trip: None, ..report }), "it names none of ours");
        assert!((0..3).all(|_| reports.poll_read().is_some()), "all go on");
    }
}
