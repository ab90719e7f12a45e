//! One suite, two buses: the rules of `Input` and `Output` hold on shared memory and in lockstep alike.
#![allow(clippy::unwrap_used, reason = "tests")]

mod buses;
mod journal;

use buses::{Bus, Shared, manifest, on_both};
use ipc_types::{Command, Particles, PilotState, Pose, Setpoint};
use runtime::shm::RunDir;
use runtime::{Cache, Lockstep, Tool};
use std::io::{BufRead, Write};

fn pose(x_m: f32) -> Pose {
    Pose { x_m, ..Pose::default() }
}

#[test]
fn a_message_arrives_with_its_header() {
    on_both(|bus| {
        let mut output = bus.ports("writer").output::<Pose>().unwrap();
        let mut input = bus.ports("reader").input::<Pose>().unwrap();
        assert!(output.publish(&pose(1.0)));
        assert!(output.publish(&pose(2.0)));
        bus.settle();
        let first = input.receive().unwrap();
        assert_eq!((first.x_m, first.header.sequence), (1.0, 1));
        assert_ne!(first.header.publisher, 0);
        let second = input.receive().unwrap();
        assert_eq!((second.x_m, second.header.sequence), (2.0, 2));
        assert!(input.receive().is_none());
        assert_eq!(input.lost(), 0);
    });
}

#[test]
fn the_oldest_is_dropped_and_counted() {
    on_both(|bus| {
        let mut output = bus.ports("writer").output::<Pose>().unwrap();
        let mut input = bus.ports("shallow").input::<Pose>().unwrap();
        assert!(output.publish(&pose(0.0)));
        bus.settle();
        assert!(input.receive().is_some());
        for x in 1..=5 {
            assert!(output.publish(&pose(x as f32)));
        }
        bus.settle();
        assert_eq!(input.receive().unwrap().x_m, 4.0);
        assert_eq!(input.receive().unwrap().x_m, 5.0);
        assert!(input.receive().is_none());
        assert_eq!(input.lost(), 3);
    });
}

#[test]
fn a_late_joiner_gets_the_newest_and_nothing_older() {
    on_both(|bus| {
        let mut output = bus.ports("writer").output::<Pose>().unwrap();
        assert!(output.publish(&pose(1.0)));
        assert!(output.publish(&pose(2.0)));
        let mut input = bus.ports("reader").input::<Pose>().unwrap();
        // Between sends it is the runtime's heartbeat that serves those who joined.
        bus.settle();
        assert_eq!(input.receive().unwrap().x_m, 2.0);
        assert!(input.receive().is_none());
        assert!(output.publish(&pose(3.0)));
        let mut later = bus.ports("reader").input::<Pose>().unwrap();
        bus.settle();
        assert_eq!(input.receive().unwrap().x_m, 3.0);
        assert_eq!(later.receive().unwrap().x_m, 3.0);
        assert!(input.receive().is_none() && later.receive().is_none());
    });
}

#[test]
fn a_late_joiner_gets_nothing_of_the_dead_and_the_newest_of_each_who_lives() {
    on_both(|bus| {
        let order = |verb: u32| Command { verb, ..Command::default() };
        let mut poses = bus.ports("writer").output::<Pose>().unwrap();
        let mut dead = bus.ports("late-operator").output::<Command>().unwrap();
        let mut first = bus.ports("operator").output::<Command>().unwrap();
        let mut second = bus.ports("other-operator").output::<Command>().unwrap();
        assert!(poses.publish(&pose(1.0)));
        assert!(dead.publish(&order(9)));
        assert!(first.publish(&order(1)));
        assert!(first.publish(&order(2)));
        assert!(second.publish(&order(3)));
        drop((poses, dead));
        bus.die("writer");
        bus.die("late-operator");
        let mut input = bus.ports("reader").input::<Pose>().unwrap();
        let mut orders = bus.ports("reader").input::<Command>().unwrap();
        bus.settle();
        assert!(input.receive().is_none());
        let mut heard: Vec<_> = std::iter::from_fn(|| orders.receive().map(|order| order.verb)).collect();
        heard.sort_unstable();
        assert_eq!(heard, [2, 3]);
    });
}

#[test]
fn a_dropped_loan_is_never_seen_and_costs_no_sequence_number() {
    on_both(|bus| {
        let mut output = bus.ports("writer").output::<Pose>().unwrap();
        let mut input = bus.ports("reader").input::<Pose>().unwrap();
        for _ in 0..40 {
            let mut loan = output.loan().unwrap();
            loan.x_m = 9.0;
        }
        assert!(output.publish(&pose(1.0)));
        bus.settle();
        let only = input.receive().unwrap();
        assert_eq!((only.x_m, only.header.sequence), (1.0, 1));
        assert!(input.receive().is_none());
    });
}

#[test]
fn a_held_message_stays_as_it_is() {
    on_both(|bus| {
        let mut output = bus.ports("writer").output::<Pose>().unwrap();
        let mut input = bus.ports("single").input::<Pose>().unwrap();
        assert!(output.publish(&pose(1.0)));
        bus.settle();
        let held = input.receive().unwrap();
        for x in 2..60 {
            assert!(output.publish(&pose(x as f32)));
            bus.settle();
            assert_eq!(input.receive().unwrap().x_m, x as f32);
        }
        assert_eq!(held.x_m, 1.0);
    });
}

#[test]
fn a_port_that_the_manifest_does_not_list_is_refused_by_name() {
    on_both(|bus| {
        let ports = bus.ports("reader");
        let text = ports.output::<Pose>().map(|_| ()).unwrap_err().to_string();
        assert!(text.contains("reader") && text.contains("publish localization/pose"), "{text}");
        let text = ports.input::<Setpoint>().map(|_| ()).unwrap_err().to_string();
        assert!(text.contains("subscribe navigation/setpoint"), "{text}");
        assert!(ports.device("controller").is_err());
        let shallow = bus.ports("shallow");
        let text = shallow.input::<Particles>().map(|_| ()).unwrap_err().to_string();
        let wanted = "conformance.toml: service.shallow.subscribes.\"localization/particles\".depth = 3: allowed is 1 to 2 \
                      for messages of this size";
        assert_eq!(text, wanted);
        let ports = bus.ports("reader");
        assert!(ports.output_of::<ipc_types::Health>("health/reader").is_ok());
        assert!(ports.output_of::<ipc_types::Health>("health/writer").is_err());
    });
}

/// `localization/pose` as another version of the words would have it.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct OldPose {
    header: ipc_types::Header,
    x_m: f64,
}
impl ipc_types::Field for OldPose {
    const LAYOUT: u64 = 1;
    fn write_json(&self, _: &mut dyn std::fmt::Write) -> std::fmt::Result {
        Ok(())
    }
    fn write_schema(out: &mut dyn std::fmt::Write) -> std::fmt::Result {
        Pose::write_schema(out)
    }
}
impl ipc_types::Message for OldPose {
    const TOPIC: &'static str = "localization/pose";
    fn header(&self) -> &ipc_types::Header {
        &self.header
    }
    fn header_mut(&mut self) -> &mut ipc_types::Header {
        &mut self.header
    }
}

#[test]
fn a_stale_binary_fails_at_open_with_one_clear_sentence() {
    let mut bus = Shared::new();
    let text = bus.ports("reader").input::<OldPose>().map(|_| ()).unwrap_err().to_string();
    assert!(text.contains("localization/pose") && text.contains("another layout"), "{text}");
    assert!(bus.ports("reader").input::<Pose>().is_ok());
}

/// Run directory of the process that [`the_publisher_that_is_killed`] plays.
const VICTIM: &str = "SERENO_TEST_VICTIM";

/// Started by the next test as a process of its own: publishes, says so and waits for its end.
#[test]
fn the_publisher_that_is_killed() {
    let Some(run_dir) = std::env::var_os(VICTIM) else { return };
    let mut tool = Tool::join("writer", manifest(), &RunDir::new(run_dir)).unwrap();
    let mut state = tool.ports.output::<PilotState>().unwrap();
    let mut particles = tool.ports.output::<Particles>().unwrap();
    for count in 1..=3_u16 {
        assert!(state.publish(&PilotState { height_m: f32::from(count), ..Default::default() }));
        let mut loan = particles.loan().unwrap();
        loan.count = count.into();
        for (place, x) in loan.x_m.iter_mut().enumerate() {
            *x = f32::from(count) + place as f32;
        }
        loan.send();
    }
    // It dies with a message half written.
    let _half = particles.loan().unwrap();
    // The byte tells whoever reads that all is sent; what the test harness prints has none of it.
    std::io::stderr().write_all(b"\0").unwrap();
    loop {
        std::thread::park();
    }
}

#[test]
fn what_is_retained_outlives_its_killed_publisher_whole() {
    let mut bus = Shared::new();
    let Some(holder) = &mut bus.holder else { unreachable!() };
    let mut process = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "the_publisher_that_is_killed", "--nocapture"])
        .env(VICTIM, bus.run_dir.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = Vec::new();
    let mut reader = std::io::BufReader::new(process.stderr.take().unwrap());
    reader.read_until(0, &mut said).unwrap();
    assert_eq!(said.last(), Some(&0), "{}", String::from_utf8_lossy(&said));
    process.kill().unwrap();
    process.wait().unwrap();

    // As the supervisor does; the keeper has seen nothing before the death.
    holder.keep();
    let mut topics = holder.restore("writer");
    holder.cleanup_dead_nodes();
    topics.sort();
    assert_eq!(topics, ["localization/particles", "pilot/state"]);
    assert_eq!(holder.pilot_state().unwrap().height_m, 3.0);
    assert!(holder.restore("reader").is_empty());

    // The next process reads it back while the keeper goes on with its turns, as its start does.
    let run_dir = bus.run_dir.clone();
    let next = std::thread::spawn(move || {
        let mut tool = Tool::restarted("writer", manifest(), &run_dir, topics).unwrap();
        let particles = tool.ports.retained::<Particles>().unwrap().unwrap();
        let state = tool.ports.retained::<PilotState>().unwrap().unwrap();
        (particles, state.height_m)
    });
    while !next.is_finished() {
        holder.keep();
        std::thread::yield_now();
    }
    let (particles, height_m) = next.join().unwrap();
    assert_eq!((particles.count, height_m), (3, 3.0));
    assert!(particles.x_m.iter().enumerate().all(|(place, x)| *x == 3.0 + place as f32));
}

#[test]
fn nothing_stays_in_shared_memory() {
    let run_dir;
    {
        let mut bus = Shared::new();
        run_dir = bus.run_dir.clone();
        let mut output = bus.ports("writer").output::<Pose>().unwrap();
        let mut input = bus.ports("reader").input::<Pose>().unwrap();
        assert!(output.publish(&pose(1.0)));
        assert!(input.receive().is_some());
        assert!(!run_dir.leftovers().is_empty());
    }
    assert_eq!(run_dir.leftovers(), Vec::<String>::new());
}

#[test]
fn the_lockstep_clock_orders_and_repeats() {
    let arrivals = |seed: u64| {
        let mut bus = Lockstep::new(manifest(), std::path::Path::new("."), seed, Cache::default());
        let mut output = bus.tool("writer").output::<Pose>().unwrap();
        let mut input = bus.tool("reader").input::<Pose>().unwrap();
        let mut seen = Vec::new();
        for step in 0..2000_u64 {
            bus.run_until(step * 100_000);
            if step % 10 == 0 {
                assert!(output.publish(&pose(step as f32)));
            }
            while let Some(message) = input.receive() {
                seen.push((bus.now(), message.header.sequence));
            }
        }
        seen
    };
    let first = arrivals(3);
    assert_eq!(first, arrivals(3));
    assert_ne!(first, arrivals(4));
    assert!(first.windows(2).all(|pair| pair[0].1 + 1 == pair[1].1));
    // No message is visible in the step in which it was sent.
    assert!(first.iter().all(|(at, sequence)| *at > (sequence - 1) * 1_000_000));
}
