//! What the camera sees, as a message.

use airframe::simulation::Simulation;
use ipc_types::{MAX_PEOPLE, PersonView, Shutter, View};

/// Fills in what a shutter that opens now lets in. `capture_ns` is now on the bus's clock, `seed` the world's.
pub(crate) fn fill_view(out: &mut View, shutter: &Shutter, flight: &Simulation, capture_ns: u64, seed: u64) {
    let motion = flight.craft().motion();
    let (roll, pitch, yaw) = motion.angles();
    let world = flight.world();
    let mut people = [PersonView::default(); MAX_PEOPLE];
    let mut people_used = 0;
    for (view, person) in people.iter_mut().zip(world.people().people()) {
        let (x_m, y_m) = person.place();
        *view = PersonView { x_m, y_m, height_m: person.height(), heading_rad: person.heading() };
        people_used += 1;
    }
    let shut = world.doors().iter().take(64).enumerate().filter(|(_, door)| door.shut);
    *out = View {
        header: out.header,
        capture_ns,
        frame: shutter.frame,
        time_s: flight.now_ns() as f64 * 1e-9,
        seed,
        doors_shut: shut.fold(0, |bits, (index, _)| bits | 1 << index),
        x_m: motion.position.x as f32,
        y_m: motion.position.y as f32,
        z_m: motion.position.z as f32,
        roll_rad: roll as f32,
        pitch_rad: pitch as f32,
        yaw_rad: yaw as f32,
        people_used,
        width: shutter.width,
        height: shutter.height,
        reserved: 0,
        people,
    };
}
