//! The lockstep bus: queues in one process, on a simulated clock.

use super::feed::Feed;
use crate::device::{ByteDevice, MemoryDevice};
use crate::port::Limits;
use crate::{Start, mix_seed};
use ipc_types::Message;
use std::any::Any;
use std::cell::{Cell, RefCell};
use std::collections::{HashMap, VecDeque};
use std::rc::Rc;

/// Wake-up delay of a message, nanoseconds: what a loaded two-core machine shows (FACTS 6: 8 us for an
/// event, up to 7 ms of scheduling latency under load).
const DELAY_LEAST_NS: u64 = 50_000;
const DELAY_SPREAD_NS: u64 = 950_000;
/// One message in this many is late by up to `DELAY_LATE_NS`.
const LATE_ONE_IN: u64 = 100;
const DELAY_LATE_NS: u64 = 6_000_000;

/// Publishers of one topic that memory is set aside for: as many as shared memory has places for.
const PUBLISHERS: usize = 4;

/// One message waiting in one input.
pub(super) struct Waiting<T> {
    pub(super) visible_ns: u64,
    pub(super) slot: Rc<T>,
}

/// Seeded delays of one input: most messages are quick, a few are late. Each input draws its own, so that who else listens
/// changes nothing.
struct Delays {
    seed: u64,
    drawn: Cell<u64>,
}

impl Delays {
    fn draw_ns(&self) -> u64 {
        let count = self.drawn.get();
        self.drawn.set(count + 1);
        let draw = mix_seed(self.seed, count);
        let late = if draw.is_multiple_of(LATE_ONE_IN) { ((draw >> 40) * DELAY_LATE_NS) >> 24 } else { 0 };
        DELAY_LEAST_NS + (((draw >> 32) * DELAY_SPREAD_NS) >> 32) + late
    }
}

pub(super) struct Queue<T> {
    pub(super) waiting: RefCell<VecDeque<Waiting<T>>>,
    depth: usize,
    delays: Delays,
    closed: Cell<bool>,
}

/// What the scheduler needs to know of an input that wakes its service, without knowing its type.
trait Waking {
    /// When the next message becomes visible, if any is still waiting after `now`.
    fn next_wake(&self, now: u64) -> u64;
    fn is_closed(&self) -> bool;
}

impl<T> Waking for Queue<T> {
    fn next_wake(&self, now: u64) -> u64 {
        let waiting = self.waiting.borrow();
        waiting.iter().map(|waiting| waiting.visible_ns).find(|visible| *visible > now).unwrap_or(u64::MAX)
    }

    fn is_closed(&self) -> bool {
        self.closed.get()
    }
}

struct Topic<T> {
    pool: RefCell<Vec<Rc<T>>>,
    pool_size: Cell<usize>,
    readers: RefCell<Vec<Rc<Queue<T>>>>,
    /// The newest message of each live publisher: what a late joiner gets.
    newest: RefCell<Vec<Rc<T>>>,
    /// The newest message of any publisher, dead ones included: what the keeper holds.
    kept: RefCell<Option<Rc<T>>>,
}

/// What the bus needs to know of a topic without knowing its type.
trait AnyTopic {
    /// Fills the pool so that no later loan allocates.
    fn fill_pool(&self);
    fn publisher_died(&self, publisher: u32);
    fn forget_closed_readers(&self);
    fn as_any(self: Rc<Self>) -> Rc<dyn Any>;
}

impl<T: Message> AnyTopic for Topic<T> {
    fn fill_pool(&self) {
        let limits = Limits::of::<T>();
        let readers = self.readers.borrow();
        // One each for the newest of every publisher, one for the keeper, two for loans.
        let wanted: usize =
            PUBLISHERS + 3 + readers.iter().map(|queue| queue.depth + limits.held.min(2)).sum::<usize>();
        self.pool_size.set(wanted);
        let mut pool = self.pool.borrow_mut();
        pool.reserve(wanted);
        while pool.len() < wanted {
            pool.push(bytemuck::allocation::zeroed_rc());
        }
    }

    fn publisher_died(&self, publisher: u32) {
        self.newest.borrow_mut().retain(|known| known.header().publisher != publisher);
    }

    fn forget_closed_readers(&self) {
        self.readers.borrow_mut().retain(|queue| !queue.closed.get());
    }

    fn as_any(self: Rc<Self>) -> Rc<dyn Any> {
        self
    }
}

/// Ends of wires that wait for their other end.
type Wires = RefCell<HashMap<String, MemoryDevice>>;

pub(crate) struct Bus {
    topics: RefCell<Vec<(String, Rc<dyn AnyTopic>)>>,
    /// The inputs that wake a service, with its name: few among many, and looked through after every step.
    waking: RefCell<Vec<(String, Rc<dyn Waking>)>>,
    wires: Wires,
    seed: u64,
    now: Cell<u64>,
    /// Where a service that is run again gets its messages from, in place of the topics.
    feed: Option<Feed>,
}

impl Bus {
    pub(crate) fn new(seed: u64) -> Rc<Self> {
        Self::with_feed(seed, None)
    }

    pub(super) fn with_feed(seed: u64, feed: Option<Feed>) -> Rc<Self> {
        Rc::new(Self {
            topics: RefCell::default(),
            waking: RefCell::default(),
            wires: RefCell::default(),
            seed,
            now: Cell::new(0),
            feed,
        })
    }

    pub(super) fn feed(&self) -> Option<&Feed> {
        self.feed.as_ref()
    }

    pub(crate) fn set_now(&self, now: u64) {
        self.now.set(now);
    }

    fn topic<T: Message>(&self, name: &str) -> Rc<Topic<T>> {
        let mut topics = self.topics.borrow_mut();
        for (known, topic) in topics.iter() {
            if known == name
                && let Ok(found) = Rc::clone(topic).as_any().downcast::<Topic<T>>()
            {
                return found;
            }
        }
        let topic = Rc::new(Topic::<T> {
            pool: RefCell::default(),
            pool_size: Cell::new(0),
            readers: RefCell::default(),
            newest: RefCell::new(Vec::with_capacity(PUBLISHERS)),
            kept: RefCell::new(None),
        });
        topics.push((name.to_owned(), Rc::clone(&topic) as Rc<dyn AnyTopic>));
        topic
    }

    pub(crate) fn input<T: Message>(
        self: &Rc<Self>,
        name: &str,
        depth: usize,
        service: &str,
        wake: bool,
    ) -> LockstepInput<T> {
        let topic = self.topic::<T>(name);
        let topic_seed = Start::service_seed(Start::service_seed(self.seed, service), name);
        let queue = Rc::new(Queue {
            waiting: RefCell::new(VecDeque::with_capacity(depth + 1)),
            depth,
            delays: Delays { seed: mix_seed(topic_seed, self.now.get()), drawn: Cell::new(0) },
            closed: Cell::new(false),
        });
        if let Some(feed) = self.feed.as_ref().filter(|feed| feed.is_of(service)) {
            feed.attach(Rc::clone(&queue));
            return LockstepInput { queue, bus: Rc::clone(self) };
        }
        if wake {
            self.waking.borrow_mut().push((service.to_owned(), Rc::clone(&queue) as Rc<dyn Waking>));
        }
        let mut visible_ns = 0;
        for newest in topic.newest.borrow().iter() {
            visible_ns = visible_ns.max(self.now.get() + queue.delays.draw_ns());
            queue.waiting.borrow_mut().push_back(Waiting { visible_ns, slot: Rc::clone(newest) });
        }
        topic.readers.borrow_mut().push(Rc::clone(&queue));
        topic.fill_pool();
        LockstepInput { queue, bus: Rc::clone(self) }
    }

    pub(crate) fn output<T: Message>(&self, name: &str) -> LockstepOutput<T> {
        let topic = self.topic::<T>(name);
        topic.fill_pool();
        LockstepOutput { topic }
    }

    /// The two services that ask for the same device are wired to each other.
    pub(crate) fn device(&self, name: &str) -> Box<dyn ByteDevice> {
        let mut wires = self.wires.borrow_mut();
        if let Some(end) = wires.remove(name) {
            return Box::new(end);
        }
        let (mine, other) = MemoryDevice::pair();
        wires.insert(name.to_owned(), other);
        Box::new(mine)
    }

    pub(crate) fn retained<T: Message>(&self) -> Option<Box<T>> {
        let topic = self.topic::<T>(T::TOPIC);
        let kept = topic.kept.borrow();
        kept.as_ref().map(|slot| {
            let mut copy = bytemuck::allocation::zeroed_box::<T>();
            bytemuck::bytes_of_mut(&mut *copy).copy_from_slice(bytemuck::bytes_of(&**slot));
            copy
        })
    }

    pub(crate) fn next_wake(&self, service: &str, now: u64) -> u64 {
        let waking = self.waking.borrow();
        let own = waking.iter().filter(|(woken, _)| woken == service);
        own.map(|(_, queue)| queue.next_wake(now)).min().unwrap_or(u64::MAX)
    }

    /// A service died: late joiners get nothing from it any more, and its queues are gone.
    pub(crate) fn died(&self, publisher: u32) {
        for (_, topic) in self.topics.borrow().iter() {
            topic.publisher_died(publisher);
            topic.forget_closed_readers();
        }
        self.waking.borrow_mut().retain(|(_, queue)| !queue.is_closed());
    }

    /// Has the keeper hold a message.
    pub(super) fn keep<T: Message>(&self, slot: Rc<T>) {
        *self.topic::<T>(T::TOPIC).kept.borrow_mut() = Some(slot);
    }
}

pub(crate) struct LockstepInput<T: Message> {
    queue: Rc<Queue<T>>,
    bus: Rc<Bus>,
}

impl<T: Message> LockstepInput<T> {
    pub(crate) fn receive(&mut self) -> Option<Rc<T>> {
        let mut waiting = self.queue.waiting.borrow_mut();
        if waiting.front()?.visible_ns > self.bus.now.get() {
            return None;
        }
        waiting.pop_front().map(|first| first.slot)
    }
}

impl<T: Message> Drop for LockstepInput<T> {
    fn drop(&mut self) {
        self.queue.closed.set(true);
    }
}

pub(crate) struct LockstepOutput<T: Message> {
    topic: Rc<Topic<T>>,
}

impl<T: Message> Clone for LockstepOutput<T> {
    fn clone(&self) -> Self {
        Self { topic: Rc::clone(&self.topic) }
    }
}

impl<T: Message> LockstepOutput<T> {
    pub(crate) fn has_readers(&self) -> bool {
        self.topic.readers.borrow().iter().any(|queue| !queue.closed.get())
    }

    /// Takes a slot that nobody else holds out of the pool.
    pub(crate) fn loan(&self) -> Option<Rc<T>> {
        let mut pool = self.topic.pool.borrow_mut();
        match pool.iter().position(|slot| Rc::strong_count(slot) == 1) {
            Some(free) => Some(pool.swap_remove(free)),
            // A loan that was dropped unsent took its slot along.
            None if pool.len() < self.topic.pool_size.get() => Some(bytemuck::allocation::zeroed_rc()),
            None => None,
        }
    }

    pub(crate) fn send(&self, slot: Rc<T>, now: u64) {
        for queue in self.topic.readers.borrow().iter().filter(|queue| !queue.closed.get()) {
            let mut waiting = queue.waiting.borrow_mut();
            // A later message is never visible before an earlier one.
            let earliest = waiting.back().map_or(0, |last| last.visible_ns);
            let visible_ns = (now + queue.delays.draw_ns()).max(earliest);
            if waiting.len() == queue.depth {
                waiting.pop_front();
            }
            waiting.push_back(Waiting { visible_ns, slot: Rc::clone(&slot) });
        }
        {
            let mut newest = self.topic.newest.borrow_mut();
            let publisher = slot.header().publisher;
            // In the order in which they were sent.
            newest.retain(|known| known.header().publisher != publisher);
            newest.push(Rc::clone(&slot));
        }
        *self.topic.kept.borrow_mut() = Some(Rc::clone(&slot));
        self.topic.pool.borrow_mut().push(slot);
    }
}
