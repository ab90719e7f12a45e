//! One flight behind ports.

use crate::view::fill_view;
use crate::{Config, build_world};
use airframe::simulation::{PingAnswer, STEP_NS, Simulation, TruthState};
use ipc_types::{
    ARM_WITH_THE_RADIO, Echo, EchoReading, FlightState, MAX_PEOPLE, PersonTruth, Ping, Shutter, Text, Truth,
    View,
};
use runtime::{ByteDevice, Input, Output, Ports, Service, Start, StartError};
use std::fmt::Write;

/// Period of the truth.
const TRUTH_NS: u64 = 20_000_000;
/// Farther behind than this the simulator does not catch up: time has stood still for the world.
const STALL_NS: u64 = 250_000_000;
/// What is still simulated of a stall.
const CATCH_UP_NS: u64 = 50_000_000;
/// Bytes moved at once; more than a tick's worth of a 115200 baud line.
const CHUNK: usize = 512;
/// Reads in one step: a peer that floods its line must not hold the world up.
const MOST_CHUNKS: usize = 16;
/// Steps between two attempts to open a device that is closed.
const REOPEN_STEPS: u64 = 200;

/// The service.
pub struct Simulator {
    flight: Simulation,
    pings: Input<Ping>,
    /// What a safety pilot reads; nobody does where there is none.
    states: Input<FlightState>,
    echoes: Output<Echo>,
    truths: Output<Truth>,
    /// The camera's shutter, and what it sees: rendered by another process, as the world must not wait for it.
    shutters: Input<Shutter>,
    views: Output<View>,
    seed: u64,
    controller: Box<dyn ByteDevice>,
    flow: Option<Box<dyn ByteDevice>>,
    /// Simulated time 0 on the bus's clock; grows by what is skipped.
    begin_ns: Option<u64>,
    next_truth_ns: u64,
    skipped_ns: u64,
    refused: u64,
    steps: u64,
    sensors: u32,
}

impl Service for Simulator {
    const NAME: &'static str = "simulator";
    type Config = Config;

    fn start(config: Config, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        if !start.simulated {
            return Err(StartError::invalid("the simulator starts in a simulated system only"));
        }
        let options = config.options(&start.vehicle, start.seed)?;
        let world = build_world(&config, start)?;
        let flight = Simulation::in_world(world, &start.vehicle, &options)
            .with_faults(&config.faults, &start.vehicle, start.seed)
            .map_err(StartError::invalid)?;
        let sensors = u32::try_from(start.vehicle.sonars.len()).unwrap_or(0);
        let mut controller = ports.device("controller")?;
        let mut flow = if ports.has_device("flow") { Some(ports.device("flow")?) } else { None };
        // A line that cannot be opened now is tried again in flight.
        let _ = controller.open();
        if let Some(flow) = &mut flow {
            let _ = flow.open();
        }
        Ok(Self {
            flight,
            pings: ports.input()?,
            states: ports.input()?,
            echoes: ports.output()?,
            truths: ports.output()?,
            shutters: ports.input()?,
            views: ports.output()?,
            seed: start.seed,
            controller,
            flow,
            begin_ns: None,
            next_truth_ns: 0,
            skipped_ns: 0,
            refused: 0,
            steps: 0,
            sensors,
        })
    }

    fn step(&mut self, now: u64) {
        let begin = self.keep_up(now);
        while let Some(state) = self.states.receive() {
            self.flight.ask_to_arm(state.reason.as_str().starts_with(ARM_WITH_THE_RADIO));
        }
        self.flight.advance_to(now.saturating_sub(begin));
        self.steps += 1;
        self.exchange();
        self.answer_pings(begin);
        if self.flight.now_ns() >= self.next_truth_ns {
            self.next_truth_ns = self.flight.now_ns() - self.flight.now_ns() % TRUTH_NS + TRUTH_NS;
            if let Some(mut loan) = self.truths.loan() {
                fill_truth(&mut loan, &self.flight);
                loan.send();
            }
        }
        if let Some(shutter) = self.shutters.latest()
            && let Some(mut loan) = self.views.loan()
        {
            fill_view(&mut loan, &shutter, &self.flight, begin + self.flight.now_ns(), self.seed);
            loan.send();
        }
    }

    fn status(&self, text: &mut Text<96>) {
        let truth = self.flight.truth();
        // What does not fit is cut off.
        let _ = write!(
            text,
            "{:.0} s, at {:.1} {:.1} {:.1} m, {:.1} V, {} contacts, {:.1} s skipped",
            truth.time_s,
            truth.x_m,
            truth.y_m,
            truth.z_m,
            truth.volts,
            truth.contacts,
            self.skipped_ns as f64 * 1e-9
        );
    }

    fn refused(&self) -> u64 {
        self.refused
    }
}

impl Simulator {
    /// Simulated time 0 on the bus's clock. After a stall (a debugger, a loaded machine) the world goes on
    /// from where it stood: simulating the lost time in one go would stall it again.
    fn keep_up(&mut self, now: u64) -> u64 {
        let begin = *self.begin_ns.get_or_insert(now);
        let behind = now.saturating_sub(begin).saturating_sub(self.flight.now_ns());
        if behind <= STALL_NS {
            return begin;
        }
        // Whole steps, so that the two clocks keep their phase.
        let skip = (behind - CATCH_UP_NS) / STEP_NS * STEP_NS;
        self.skipped_ns += skip;
        self.begin_ns = Some(begin + skip);
        begin + skip
    }

    /// Bytes written since the last step are on the wire from now on, never earlier.
    fn exchange(&mut self) {
        let mut chunk = [0; CHUNK];
        if open(&mut *self.controller, self.steps) {
            for _ in 0..MOST_CHUNKS {
                let Ok(count @ 1..) = self.controller.read(&mut chunk) else { break };
                self.flight.controller_write(&chunk[..count.min(CHUNK)]);
            }
        }
        loop {
            let count = self.flight.controller_read(&mut chunk);
            if count == 0 {
                break;
            }
            // What nobody takes is lost, as on a real wire.
            let _ = self.controller.write(&chunk[..count]);
        }
        let Some(flow) = &mut self.flow else { return };
        if open(&mut **flow, self.steps) {
            // The sensor hears nothing; reading is how the device notices that its reader is gone.
            let _ = flow.read(&mut chunk);
        }
        loop {
            let count = self.flight.flow_read(&mut chunk);
            if count == 0 {
                break;
            }
            let _ = flow.write(&chunk[..count]);
        }
    }

    fn answer_pings(&mut self, begin: u64) {
        while let Some(ping) = self.pings.receive() {
            if ping.sensors == 0 || u64::from(ping.sensors) >> self.sensors != 0 {
                self.refused += 1;
                continue;
            }
            self.flight.ping(ping.sensors, ping.ping);
        }
        while let Some(answer) = self.flight.take_echo() {
            if let Some(mut loan) = self.echoes.loan() {
                fill_echo(&mut loan, &answer, begin);
                loan.send();
            }
        }
    }
}

/// Whether the device is open; a closed one is tried again now and then.
fn open(device: &mut dyn ByteDevice, steps: u64) -> bool {
    device.is_open() || (steps.is_multiple_of(REOPEN_STEPS) && device.open().is_ok())
}

fn fill_echo(echo: &mut Echo, answer: &PingAnswer, begin: u64) {
    echo.ping_ns = begin + answer.ping_ns;
    echo.ping = answer.ping;
    echo.count = 0;
    for (heard, answered) in answer.readings().take(echo.readings.len()) {
        echo.readings[echo.count as usize] = EchoReading {
            pulse_s: if answered { heard.pulse_s } else { f32::NAN },
            sensor: heard.sensor,
            answered: u8::from(answered),
            reserved: 0,
        };
        echo.count += 1;
    }
    for unused in &mut echo.readings[echo.count as usize..] {
        *unused = EchoReading::default();
    }
}

fn fill_truth(out: &mut Truth, flight: &Simulation) {
    let truth: TruthState = flight.truth();
    let mut people = [PersonTruth::default(); MAX_PEOPLE];
    let mut people_used = 0;
    for (place, person) in people.iter_mut().zip(flight.world().people().people()) {
        let solid = person.solid();
        *place = PersonTruth { x_m: solid.x, y_m: solid.y };
        people_used += 1;
    }
    *out = Truth {
        header: out.header,
        time_s: truth.time_s,
        x_m: truth.x_m,
        y_m: truth.y_m,
        z_m: truth.z_m,
        roll_rad: truth.roll_rad,
        pitch_rad: truth.pitch_rad,
        yaw_rad: truth.yaw_rad,
        velocity_x_m_s: truth.velocity_m_s[0],
        velocity_y_m_s: truth.velocity_m_s[1],
        velocity_z_m_s: truth.velocity_m_s[2],
        clearance_m: truth.clearance_m,
        min_clearance_m: truth.min_clearance_m,
        volts: truth.volts,
        charge: truth.charge,
        contacts: truth.contacts,
        armed: u32::from(truth.armed),
        on_ground: u32::from(truth.on_ground),
        people_used,
        reserved: 0,
        people,
    };
}
