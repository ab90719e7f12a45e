//! `trace/<service>`: what each step took from its inputs.
//!
//! The same on both buses, and told by no real clock. Inputs note what is taken in [`Taken`] while a step runs;
//! [`Journal`] publishes it at the step's end.

use crate::port::StepContext;
use crate::{Output, Ports, Start, StartError};
use ipc_types::{Header, MAX_RUNS, Message, Run, Trace};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// What the present step has taken so far. Shared by the inputs of a service and its journal; of constant size, so that
/// nothing is allocated.
#[derive(Debug, Default)]
pub(crate) struct Taken {
    /// Programs beside the services have no steps: nothing is noted for them.
    journaled: Cell<bool>,
    step: Cell<u64>,
    runs: RefCell<[Run; MAX_RUNS]>,
    used: Cell<usize>,
    truncated: Cell<u32>,
}

/// Where the newest run of one input stands.
#[derive(Debug, Default)]
pub(crate) struct Cursor {
    /// The step that it belongs to, counted from 1; 0 for none.
    step: Cell<u64>,
    /// Its place; [`MAX_RUNS`] when it found none.
    place: Cell<usize>,
    /// The step in which the input was found empty.
    dry: Cell<u64>,
}

impl Taken {
    /// Whether somebody keeps a journal; when not, there are no steps either.
    pub(crate) fn is_journaled(&self) -> bool {
        self.journaled.get()
    }

    /// Number of the present step and its start, from 1.
    fn now(&self) -> u64 {
        self.step.get() + 1
    }

    /// Notes that an input has nothing more. It stays so to the end of the step: a message that came while the step
    /// ran would otherwise be taken by the second of two looks, and the journal does not tell one look from another.
    pub(crate) fn dry(&self, cursor: &Cursor) {
        cursor.dry.set(self.now());
    }

    /// Whether an input was empty already in this step.
    pub(crate) fn is_dry(&self, cursor: &Cursor) -> bool {
        self.is_journaled() && cursor.dry.get() == self.now()
    }

    /// Notes a message of the input that `cursor` belongs to.
    pub(crate) fn note(&self, cursor: &Cursor, port: u16, topic: u32, header: &Header) {
        if !self.is_journaled() {
            return;
        }
        let mut runs = self.runs.borrow_mut();
        if cursor.step.get() == self.now()
            && let Some(run) = runs.get_mut(cursor.place.get())
            && continues(run, header)
        {
            run.count += 1;
            return;
        }
        // Also when there is no place any more: a later message that continued an earlier run, with one between them that
        // found none, would make the order wrong without a word.
        let place = self.used.get();
        cursor.step.set(self.now());
        cursor.place.set(place);
        let Some(run) = runs.get_mut(place) else { return self.truncate() };
        *run = Run {
            first: header.sequence,
            publisher: header.publisher,
            incarnation: header.incarnation,
            topic,
            port,
            count: 1,
        };
        self.used.set(place + 1);
    }

    fn truncate(&self) {
        self.truncated.set(self.truncated.get().saturating_add(1));
    }

    fn write(&self, trace: &mut Trace) {
        let runs = self.runs.borrow();
        trace.runs.set(runs.get(..self.used.get()).unwrap_or_default());
        trace.truncated = self.truncated.get();
    }

    /// The step is over.
    fn close(&self) {
        self.step.set(self.step.get() + 1);
        self.used.set(0);
        self.truncated.set(0);
    }
}

/// Whether a message is the next of a run.
fn continues(run: &Run, header: &Header) -> bool {
    (run.publisher, run.incarnation) == (header.publisher, header.incarnation)
        && run.count < u16::MAX
        && run.first.checked_add(run.count.into()) == Some(header.sequence)
}

/// Publishes `trace/<service>`.
pub struct Journal {
    trace: Output<Trace>,
    taken: Rc<Taken>,
    context: Rc<StepContext>,
    step: u64,
    seed: u64,
    config: u64,
    plan: u64,
    ports: u32,
}

impl Journal {
    /// Opens the journal of the service whose ports these are. From now on what its inputs give is noted.
    ///
    /// # Errors
    /// When the service is none of the manifest's, or shared memory refuses.
    pub fn open(ports: &mut Ports) -> Result<Self, StartError> {
        let trace = ports.output_of(&format!("{}/{}", Trace::TOPIC, ports.service))?;
        ports.taken.journaled.set(true);
        Ok(Self {
            trace,
            taken: Rc::clone(&ports.taken),
            context: Rc::clone(&ports.context),
            step: 0,
            seed: 0,
            config: 0,
            plan: 0,
            ports: 0,
        })
    }

    /// Makes the entry of the start, with what was taken meanwhile: retained samples too. `config` is the hash of the
    /// configuration file.
    pub fn begin(&mut self, ports: &Ports, start: &Start, config: u64) {
        self.seed = start.seed;
        self.config = config;
        self.plan = start.plan_hash.get();
        self.ports = ports.inputs.len() as u32;
        self.publish();
        self.taken.close();
    }

    /// Makes the entry of the step that is over. Where nobody listens and nobody can have missed it, in lockstep, it is
    /// not written; the entry of the start always is, for who joins before the first step.
    pub fn step(&mut self) {
        self.step += 1;
        if self.trace.is_heard() {
            self.publish();
        }
        self.taken.close();
    }

    /// Steps since start.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.step
    }

    fn publish(&mut self) {
        // An entry that finds no place is counted by its output, and missing in the step numbers.
        let Some(mut loan) = self.trace.loan() else { return };
        let trace: &mut Trace = &mut loan;
        trace.step = self.step;
        trace.now_ns = self.context.now.get();
        trace.seed = self.seed;
        trace.config = self.config;
        trace.plan = self.plan;
        trace.ports = self.ports;
        self.taken.write(trace);
        loan.send();
    }
}
