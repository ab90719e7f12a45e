//! What lies below, by the beam and by the cone.

use crate::rig::Rig;

/// Seeds 1 to 4. The cone hears a table's edge in half of its pings for 20 s: the sonar alone takes that for its own
/// motion, up to the ceiling; the beam never sees it.
#[test]
fn an_edge_in_the_cone_moves_nothing_while_the_beam_sees_the_floor() {
    for seed in 1..=4 {
        let mut rig = Rig::new(seed);
        rig.beam = true;
        rig.take_off();
        rig.run(4.0);
        let worst_over = |rig: &mut Rig, steps: u32| {
            (0..steps).fold(0.0f32, |worst, _| {
                rig.step();
                worst.max((rig.height - 1.2).abs())
            })
        };
        rig.edge = 0.75;
        let worst = worst_over(&mut rig, 1000);
        assert!(worst < 0.12, "seed {seed}: {worst} beside a table");
        // A plant that reaches almost up to the skids: the drone makes room for it, and comes down again behind it.
        rig.edge = 1.1;
        rig.run(4.0);
        assert!((1.3..1.5).contains(&rig.height), "seed {seed}: {} over a plant", rig.height);
        rig.edge = 0.0;
        rig.run(5.0);
        // The beam falls silent: the sonar goes on.
        rig.beam = false;
        let worst = worst_over(&mut rig, 500);
        assert!(worst < 0.12, "seed {seed}: {worst} by the sonar");
    }
}
