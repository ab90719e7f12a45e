//! The order trap: MSP_SET_RAW_RC takes channels in the receiver's order, MSP_RC answers in another.

use crate::wish::{PITCH, ROLL, THROTTLE, YAW};
use msp::messages::{RcReply, RxMapReply};

/// Where each of our channels stands in the receiver's order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReceiverOrder {
    /// Position of roll, pitch, throttle, yaw, AUX1...
    positions: [u8; 8],
}

impl ReceiverOrder {
    /// Roll, pitch, throttle, yaw: Betaflight's and INAV's default, and ours.
    pub const AETR: Self = Self { positions: [0, 1, 2, 3, 4, 5, 6, 7] };

    /// From what the controller says; `None` when two channels claim one place.
    #[must_use]
    pub fn read(map: &RxMapReply) -> Option<Self> {
        // The controller lists roll, pitch, yaw, throttle, AUX1...
        let mut positions = map.positions;
        positions.swap(THROTTLE, YAW);
        for (index, position) in positions.iter_mut().enumerate().skip(usize::from(map.count)) {
            *position = index as u8;
        }
        let taken =
            positions.iter().fold(0u32, |taken, at| taken | 1u32.checked_shl((*at).into()).unwrap_or(0));
        (taken == 0xff).then_some(Self { positions })
    }

    /// Our channels in the receiver's order. A frame shorter than a position leaves that channel out: the
    /// caller sends at least four, and a map that moves sticks beyond is padded.
    #[must_use]
    pub fn arrange(&self, channels_us: &[u16; 18], count: usize) -> ([u16; 18], usize) {
        let mut arranged = *channels_us;
        let mut end = count;
        for (channel, &position) in self.positions.iter().enumerate() {
            if let (Some(slot), Some(&us)) =
                (arranged.get_mut(usize::from(position)), channels_us.get(channel))
            {
                *slot = us;
                if channel < count {
                    end = end.max(usize::from(position) + 1);
                }
            }
        }
        (arranged, end)
    }
}

/// The throttle in an answer to MSP_RC: roll, pitch, yaw, THROTTLE whatever the receiver's order is.
#[must_use]
pub fn throttle_of(rc: &RcReply) -> Option<u16> {
    (rc.count >= 4).then(|| rc.channels_us[3])
}

const _: () = assert!(ROLL == 0 && PITCH == 1 && THROTTLE == 2 && YAW == 3);

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: [u16; 18] = {
        let mut channels = [1000; 18];
        let mut i = 0;
        while i < 18 {
            channels[i] = 1100 + i as u16;
            i += 1;
        }
        channels
    };

    #[test]
    fn aetr_stays_and_taer_moves() {
        let aetr =
            ReceiverOrder::read(&RxMapReply { positions: [0, 1, 3, 2, 4, 5, 6, 7], count: 8 }).unwrap();
        assert_eq!(aetr.arrange(&OURS, 6), (OURS, 6));
        assert_eq!(aetr, ReceiverOrder::AETR);
        // TAER: throttle first, so roll is at 1, pitch at 2, yaw at 3, throttle at 0. INAV sends four.
        let taer =
            ReceiverOrder::read(&RxMapReply { positions: [1, 2, 3, 0, 0, 0, 0, 0], count: 4 }).unwrap();
        let (channels, count) = taer.arrange(&OURS, 6);
        assert_eq!((count, &channels[..6]), (6, &[1102, 1100, 1101, 1103, 1104, 1105][..]));
    }

    #[test]
    fn a_map_that_is_no_permutation_is_refused() {
        for positions in [[0, 1, 1, 2, 4, 5, 6, 7], [0, 1, 3, 2, 4, 5, 6, 9], [255; 8]] {
            assert_eq!(ReceiverOrder::read(&RxMapReply { positions, count: 8 }), None);
        }
    }

    #[test]
    fn rc_answers_throttle_fourth() {
        let mut rc = RcReply { channels_us: OURS, count: 18 };
        assert_eq!(throttle_of(&rc), Some(1103));
        rc.count = 0;
        assert_eq!(throttle_of(&rc), None);
    }
}
