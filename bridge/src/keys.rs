//! The names of things on zenoh (`docs/off-board.md`, *Keys*).

use ipc_types::Verb;

/// Keys of one drone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Keys {
    drone: String,
}

impl Keys {
    /// Keys of the drone of this name (`*` for those of every drone).
    #[must_use]
    pub fn of(drone: &str) -> Self {
        Self { drone: drone.to_owned() }
    }

    /// Of the drone's own liveliness token.
    #[must_use]
    pub fn alive(&self) -> String {
        format!("sereno/{}/alive", self.drone)
    }

    /// Of what the drone says of itself.
    #[must_use]
    pub fn about(&self) -> String {
        format!("sereno/{}/about", self.drone)
    }

    /// Of the picture of the plan.
    #[must_use]
    pub fn plan(&self) -> String {
        format!("sereno/{}/plan", self.drone)
    }

    /// Of the drone's clock.
    #[must_use]
    pub fn beacon(&self) -> String {
        format!("sereno/{}/beacon", self.drone)
    }

    /// Of one topic (`**` for all).
    #[must_use]
    pub fn telemetry(&self, topic: &str) -> String {
        format!("sereno/{}/telemetry/{topic}", self.drone)
    }

    /// Of an order, by its word in keys (`*` for all) and the certificate of who gives it.
    #[must_use]
    pub fn command(&self, verb: &str, certificate: &str) -> String {
        format!("sereno/{}/command/{verb}/{certificate}", self.drone)
    }

    /// Of the sticks of a certificate.
    #[must_use]
    pub fn sticks(&self, certificate: &str) -> String {
        format!("sereno/{}/sticks/{certificate}", self.drone)
    }

    /// Of what a certificate wishes of the camera.
    #[must_use]
    pub fn wish(&self, certificate: &str) -> String {
        format!("sereno/{}/wish/{certificate}", self.drone)
    }

    /// Of a certificate's changes of the building.
    #[must_use]
    pub fn edit(&self, certificate: &str) -> String {
        format!("sereno/{}/edit/{certificate}", self.drone)
    }

    /// Of what a certificate says in a video session, or hears.
    #[must_use]
    pub fn signal(&self, certificate: &str, session: &str, direction: Direction) -> String {
        let end = match direction {
            Direction::In => "in",
            Direction::Out => "out",
        };
        format!("sereno/{}/signal/{certificate}/{session}/{end}", self.drone)
    }
}

/// Which way a message of a video session goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// To the drone.
    In,
    /// From it.
    Out,
}

/// The word of a verb in keys: `patrol-start`.
#[must_use]
pub fn verb_word(verb: Verb) -> String {
    verb.word().replace(' ', "-")
}

/// The inverse of [`verb_word`].
#[must_use]
pub fn verb_from_word(word: &str) -> Option<Verb> {
    Verb::ALL.iter().copied().find(|verb| verb_word(*verb) == word)
}

/// Part `index` of a key, counted from 0.
#[must_use]
pub fn part(key: &str, index: usize) -> Option<&str> {
    key.split('/').nth(index)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn verbs_are_one_part_of_a_key_and_come_back() {
        for verb in Verb::ALL {
            let word = verb_word(*verb);
            assert!(word.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-'), "{word}");
            assert_eq!(verb_from_word(&word), Some(*verb));
            let key = Keys::of("sereno-1").command(&word, "desk");
            assert_eq!((part(&key, 3), part(&key, 4)), (Some(word.as_str()), Some("desk")));
        }
        assert_eq!(verb_from_word("patrol start"), None);
    }
}
