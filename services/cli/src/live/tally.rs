//! What was passed on and what was not.

use std::collections::BTreeMap;

/// Counts of one run.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    passed: u64,
    not_understood: BTreeMap<String, u64>,
}

impl Tally {
    /// Notes a message of a topic. Returns what to say of it: the first of a topic that is not understood is named, the others
    /// are counted.
    pub(crate) fn note(&mut self, topic: &str, understood: Result<(), &str>) -> Option<String> {
        let Err(reason) = understood else {
            self.passed = self.passed.saturating_add(1);
            return None;
        };
        let count = self.not_understood.entry(topic.to_owned()).or_default();
        *count = count.saturating_add(1);
        (*count == 1).then(|| format!("{topic}: {reason}; left out and counted"))
    }

    pub(crate) const fn passed(&self) -> u64 {
        self.passed
    }

    /// Messages that were not understood, of all topics.
    pub(crate) fn not_understood(&self) -> u64 {
        self.not_understood.values().fold(0, |sum, count| sum.saturating_add(*count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_understood_is_said_once_a_topic_and_counted() {
        let mut tally = Tally::default();
        assert_eq!(tally.note("a/b", Ok(())), None);
        let said = tally.note("a/b", Err("it is no JSON"));
        assert_eq!(said.as_deref(), Some("a/b: it is no JSON; left out and counted"));
        assert_eq!(tally.note("a/b", Err("it is no JSON")), None);
        assert!(tally.note("a/c", Err("it is no JSON")).is_some());
        assert_eq!((tally.passed(), tally.not_understood()), (1, 3));
    }
}
