//! Whatever moves the drone carries an expiry that later stages only shorten.

use crate::rig::{MS, Rig};
use control::Vector;
use ipc_types::{ChannelSource, Phase, SetpointKind, Verb};

#[test]
fn channels_never_outlive_the_setpoint_they_were_made_from() {
    let mut rig = Rig::new(5);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.2, 0.0), Vector { x: f32::NAN, y: f32::NAN });
    rig.order(Verb::PatrolStart);
    rig.run(12.0);
    assert_eq!(rig.phase(), Phase::Autonomous);
    assert_eq!(rig.channels.source, ChannelSource::Navigation.code());
    let last = rig.setpoint.take().unwrap().expiry_ns;
    let (mut flown, mut shortened) = (0, 0);
    for _ in 0..30 {
        let at = rig.now;
        rig.step();
        let (source, expiry) = (rig.channels.source, rig.channels.expiry_ns);
        if source == ChannelSource::Navigation.code() {
            flown += 1;
            assert!(expiry <= last, "{} ms after the setpoint's", (expiry - last) / MS);
            // Long enough for the next channels to reach the controller in time.
            assert!(expiry >= at + 40 * MS, "only {} ms left", (expiry - at) / MS);
            shortened += u32::from(expiry < at + 120 * MS);
        } else {
            assert!(expiry.abs_diff(at + 120 * MS) < MS, "the pilot's own hover lives by its own expiry");
        }
    }
    assert!(flown >= 8 && shortened >= 3, "{flown} {shortened}");
}
