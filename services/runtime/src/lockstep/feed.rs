//! What a service that is run again finds in its inputs: nothing but what was put there.

use super::bus::{Queue, Waiting};
use ipc_types::{Message, Run};
use std::any::Any;
use std::cell::RefCell;
use std::rc::Rc;

/// The inputs of one service, filled by hand.
pub(super) struct Feed {
    service: String,
    /// The inputs, in the order in which the service opened them.
    queues: RefCell<Vec<Rc<dyn Any>>>,
    /// Messages for inputs that are not open yet, with the input's number: what a start takes.
    early: RefCell<Vec<(u16, Rc<dyn Any>)>>,
}

impl Feed {
    pub(super) fn new(service: &str) -> Self {
        Self { service: service.to_owned(), queues: RefCell::default(), early: RefCell::default() }
    }

    pub(super) fn is_of(&self, service: &str) -> bool {
        self.service == service
    }

    /// The service opens its next input.
    pub(super) fn attach<T: Message>(&self, queue: Rc<Queue<T>>) {
        let mut queues = self.queues.borrow_mut();
        let port = u16::try_from(queues.len()).unwrap_or(Run::KEEPER);
        self.early.borrow_mut().retain(|(wanted, message)| match Rc::clone(message).downcast::<T>() {
            Ok(slot) if *wanted == port => {
                put(&queue, slot);
                false
            }
            _ => true,
        });
        queues.push(queue);
    }

    /// Whether every message found its input.
    pub(super) fn is_placed(&self) -> bool {
        self.early.borrow().is_empty()
    }

    /// Puts a message into the input numbered `port`. False when that input reads another topic.
    pub(super) fn give<T: Message>(&self, port: u16, slot: Rc<T>) -> bool {
        match self.queues.borrow().get(usize::from(port)) {
            None => {
                self.early.borrow_mut().push((port, slot));
                true
            }
            Some(queue) => match Rc::clone(queue).downcast::<Queue<T>>() {
                Ok(queue) => {
                    put(&queue, slot);
                    true
                }
                Err(_) => false,
            },
        }
    }
}

/// However many there are: what was dropped for want of room was never taken, so nobody puts it here.
fn put<T: Message>(queue: &Queue<T>, slot: Rc<T>) {
    queue.waiting.borrow_mut().push_back(Waiting { visible_ns: 0, slot });
}
