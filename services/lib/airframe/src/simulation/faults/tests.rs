use super::line::Way;
use super::*;
use crate::simulation::{Options, Simulation};
use crate::world::{AsBuilt, ClutterLevel, World, WorldFile};
use floorplan::{Plan, Sidecar};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    fault: Vec<Fault>,
}

fn parse(text: &str) -> Result<Vec<Fault>, String> {
    toml::from_str::<File>(&format!("[[fault]]\n{text}")).map(|file| file.fault).map_err(|e| e.to_string())
}

fn one(text: &str) -> Fault {
    parse(text).unwrap().remove(0)
}

#[test]
fn every_kind_is_read_and_nonsense_is_refused_by_name() {
    let good = [
        "kind = \"sonar-dead\"\nsonars = [\"down\"]\nfrom_s = 3\nuntil_s = 4",
        "kind = \"sonar-deaf\"\nsonars = [\"sides\"]",
        "kind = \"sonar-stuck\"\nsonars = [\"front\"]\nmetres = 1.0",
        "kind = \"sonar-spikes\"\nsonars = [\"all\"]\nshare = 0.2",
        "kind = \"sonar-crosstalk\"\nsonars = [\"front\"]\nhears = \"left\"",
        "kind = \"sonar-taped\"\nsonars = [\"front\"]",
        "kind = \"sonar-turned\"\nsonars = [\"front\"]\ndegrees = 20",
        "kind = \"compass-swing\"\ndegrees = 40",
        "kind = \"battery-sag\"\nohm = 0.05",
        "kind = \"battery-charge\"\ncharge = 0.1",
        "kind = \"battery-cell\"",
        "kind = \"motor-weak\"\nmotor = \"front-left\"\nshare = 0.15",
        "kind = \"gust\"\nm_s2 = 1.0\ndegrees = 90",
        "kind = \"controller-reboot\"\nseconds = 1.0",
        "kind = \"serial-flipped\"\nline = \"both\"\nshare = 0.01",
        "kind = \"serial-lost\"\nline = \"to\"\nshare = 0.01",
        "kind = \"serial-doubled\"\nline = \"from\"\nshare = 0.01",
        "kind = \"serial-delayed\"\nline = \"both\"\nseconds = 0.1",
        "kind = \"serial-silent\"\nline = \"both\"",
        "kind = \"flow-silent\"",
        "kind = \"flow-poor\"\nshare = 0.2",
        "kind = \"carried-off\"\nmetres = 1.0\ndegrees = 0",
        "kind = \"door-shuts\"\nname = \"Store\"",
        "kind = \"door-opens\"\nname = \"Store\"",
        "kind = \"person-comes\"\nx_m = 1.0\ny_m = 2.0\nm_s = 1.0\nup_to_m = 0.8",
    ];
    for text in good {
        assert!(parse(text).is_ok(), "{text}: {:?}", parse(text));
    }
    for (text, words) in [
        ("kind = \"sonar-asleep\"\nsonars = [\"down\"]", ["sonar-asleep", "sonar-taped"]),
        ("kind = \"sonar-dead\"", ["sonars", "missing"]),
        ("kind = \"sonar-dead\"\nsonars = []", ["sonars", "empty"]),
        ("kind = \"sonar-dead\"\nsonars = [\"down\"]\nshare = 0.5", ["no share", "sonar-dead"]),
        ("kind = \"gust\"\nm_s2 = 9.0\ndegrees = 0", ["m_s2", "0..=5"]),
        ("kind = \"gust\"\nm_s2 = nan\ndegrees = 0", ["m_s2", "NaN"]),
        ("kind = \"compass-swing\"\ndegrees = 1\nfrom_s = 5\nuntil_s = 4", ["until_s", "5..="]),
        ("kind = \"serial-lost\"\nline = \"up\"\nshare = 0.1", ["line", "to, from, both"]),
        ("kind = \"motor-weak\"\nmotor = \"left\"\nshare = 0.1", ["motor", "rear-left"]),
        ("kind = \"compass-swing\"\ndegrees = 1\ncolour = 3", ["colour", "unknown"]),
    ] {
        let error = parse(text).unwrap_err();
        assert!(words.iter().all(|word| error.contains(word)), "{text}: {error}");
    }
}

#[test]
fn a_fault_holds_from_its_beginning_to_its_end_counted_from_the_take_off() {
    let fault = one("kind = \"battery-cell\"\nfrom_s = 3\nuntil_s = 4");
    let held: Vec<bool> =
        [None, Some(0.0), Some(2.9), Some(3.0), Some(3.9), Some(4.0)].map(|t| fault.holds(t)).into();
    assert_eq!(held, [false, false, false, true, true, false]);
    let from_the_start = one("kind = \"battery-cell\"\nuntil_s = 4");
    assert!(from_the_start.holds(None) && from_the_start.holds(Some(1.0)));
    assert!(!from_the_start.holds(Some(4.0)));
}

/// 100 000 bytes, a share of 10 %: the standard deviation of each count is under 100.
#[test]
fn a_line_loses_turns_over_and_doubles_its_share_of_bytes() {
    let passed = |faults: &[LineFault]| {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut way = Way::default();
        let (mut count, mut changed) = (0_i32, 0_i32);
        for _ in 0..1000 {
            way.take(0, &[0xa5; 100], faults, &mut random);
            while let Some(byte) = way.next(0) {
                count += 1;
                changed += i32::from((byte ^ 0xa5).count_ones() == 1);
            }
        }
        (count, changed)
    };
    assert_eq!(passed(&[]), (100_000, 0));
    let (lost, _) = passed(&[LineFault::Lost { share: 0.1 }]);
    assert!((lost - 90_000).abs() < 500, "{lost}");
    let (doubled, _) = passed(&[LineFault::Doubled { share: 0.1 }]);
    assert!((doubled - 110_000).abs() < 500, "{doubled}");
    let (all, changed) = passed(&[LineFault::Flipped { share: 0.1 }]);
    assert!(all == 100_000 && (changed - 10_000).abs() < 500, "{all} {changed}");
    assert_eq!(passed(&[LineFault::Silent]), (0, 0));
}

#[test]
fn what_is_delayed_keeps_its_order_when_the_delay_ends() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut way = Way::default();
    way.take(0, &[1], &[LineFault::Delayed { seconds: 0.1 }], &mut random);
    way.take(1_000_000, &[2], &[], &mut random);
    assert_eq!(way.next(99_999_999), None);
    assert_eq!([way.next(100_000_000), way.next(100_000_000)], [Some(1), Some(2)]);
}

const ROOM: [&str; 8] = [
    "########################################",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "########################################",
];

fn standing(faults: &[Fault]) -> Result<Simulation, FaultError> {
    let plan = Plan::from_ascii(&ROOM, 0.5);
    let file = WorldFile::parse("room.toml", "pad = { x_m = 8.0, y_m = 2.0 }").unwrap();
    let side = Sidecar::default();
    let world = World::build_as(&plan, &side, &file, ClutterLevel::None, 1, AsBuilt::exact()).unwrap();
    let vehicle = crate::testing::watchman();
    Simulation::in_world(world, &vehicle, &Options::default()).with_faults(faults, &vehicle, 1)
}

/// Ranges of one sensor over forty pings, metres; `None` where it did not answer.
fn ranges(sim: &mut Simulation, sensor: u8) -> Vec<Option<f32>> {
    (0..40)
        .map(|number| {
            sim.ping(1 << sensor, number);
            let next = sim.now_ns() + 70_000_000;
            sim.advance_to(next);
            let (echo, answered) = sim.take_echo().unwrap().readings().next().unwrap();
            answered.then_some(echo.pulse_s * 343.0 / 2.0)
        })
        .collect()
}

#[test]
fn sonars_fail_each_in_its_own_way() {
    let heard = |text: &str| ranges(&mut standing(&[one(text)]).unwrap(), 2);
    assert!(heard("kind = \"sonar-dead\"\nsonars = [\"left\"]").iter().all(Option::is_none));
    assert!(heard("kind = \"sonar-deaf\"\nsonars = [\"sides\"]").iter().all(|r| r.unwrap().is_nan()));
    let stuck = heard("kind = \"sonar-stuck\"\nsonars = [\"left\"]\nmetres = 2.5");
    assert!(stuck.iter().all(|r| (r.unwrap() - 2.5).abs() < 1e-4), "{stuck:?}");
    let taped = heard("kind = \"sonar-taped\"\nsonars = [\"left\"]");
    assert!(taped.iter().all(|r| (0.02..0.051).contains(&r.unwrap())), "{taped:?}");
    // Unlike the others this one still measures: a wall 1.5 m away, and spikes all over.
    let far = |heard: &[Option<f32>]| heard.iter().filter(|r| (r.unwrap() - 1.5).abs() > 0.3).count();
    let sound = heard("kind = \"sonar-dead\"\nsonars = [\"rear\"]");
    let spiking = heard("kind = \"sonar-spikes\"\nsonars = [\"left\"]\nshare = 0.9");
    assert!(far(&spiking) > far(&sound) + 10, "{spiking:?} {sound:?}");
}

#[test]
fn names_that_there_are_not_are_refused() {
    for (text, word) in [
        ("kind = \"sonar-dead\"\nsonars = [\"top\"]", "front-left"),
        ("kind = \"sonar-crosstalk\"\nsonars = [\"front\"]\nhears = \"top\"", "hears"),
        ("kind = \"door-shuts\"\nname = \"Cellar\"", "Cellar"),
    ] {
        let error = standing(&[one(text)]).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn a_flight_whose_faults_never_begin_is_the_flight_without_any() {
    let never = one("kind = \"sonar-dead\"\nsonars = [\"all\"]\nfrom_s = 3000");
    let run = |faults: &[Fault]| {
        let mut sim = standing(faults).unwrap();
        let heard = ranges(&mut sim, 0);
        format!("{:?} {heard:?}", sim.truth())
    };
    assert_eq!(run(&[]), run(&[never]));
}

#[test]
fn a_controller_that_reboots_is_silent_and_then_knows_nothing_of_its_arming() {
    let mut sim = standing(&[one("kind = \"controller-reboot\"\nseconds = 1.0")]).unwrap();
    let answers = |sim: &mut Simulation| {
        // MSP_API_VERSION.
        sim.controller_write(&[b'$', b'M', b'<', 0, 1, 1]);
        let next = sim.now_ns() + 100_000_000;
        sim.advance_to(next);
        sim.controller_read(&mut [0; 64])
    };
    sim.advance_to(10_000_000);
    assert_eq!(answers(&mut sim), 0);
    sim.advance_to(1_100_000_000);
    assert!(answers(&mut sim) > 0);
}
