//! The list of all topics: for those who hold, list or print them without knowing their types.

use crate::{
    Attitude, Channels, Command, Echo, FlightState, FlowMotion, Grid, Health, Message, Particles, Patrol,
    Picture, PilotState, Ping, Polar, Pose, Power, Setpoint, Shutter, SignalIn, SignalOut, SonarRanges,
    Sticks, Still, Trace, Truth, Video, View, Wish,
};

/// Something to be done with a message type known only by its topic.
pub trait TopicVisitor {
    /// What comes of it.
    type Output;
    /// Called with the type that travels on the topic.
    fn visit<T: Message>(&mut self) -> Self::Output;
}

macro_rules! topics {
    ($($t:ty),* $(,)?) => {
        /// Calls `visitor` with the type that travels on `topic` (`health/sonar` finds [`Health`]);
        /// `None` when there is no such topic.
        pub fn visit_topic<V: TopicVisitor>(topic: &str, visitor: &mut V) -> Option<V::Output> {
            let family = topic.split('/').next().unwrap_or("");
            $(
                if topic == <$t>::TOPIC || (!<$t>::TOPIC.contains('/') && family == <$t>::TOPIC && topic.len() > family.len() + 1) {
                    return Some(visitor.visit::<$t>());
                }
            )*
            None
        }

        /// Calls `visitor` with every type, in the order of DESIGN 3.
        pub fn visit_all<V: TopicVisitor>(visitor: &mut V) {
            $( visitor.visit::<$t>(); )*
        }
    };
}
topics!(
    SonarRanges,
    FlowMotion,
    Ping,
    Echo,
    Truth,
    Shutter,
    View,
    Attitude,
    FlightState,
    Power,
    Pose,
    Particles,
    Grid,
    Polar,
    Setpoint,
    Patrol,
    Channels,
    PilotState,
    Sticks,
    Command,
    Picture,
    Video,
    Still,
    Wish,
    SignalIn,
    SignalOut,
    Health,
    Trace,
);

#[cfg(test)]
mod tests {
    use super::*;

    struct Name;
    impl TopicVisitor for Name {
        type Output = (&'static str, u64);
        fn visit<T: Message>(&mut self) -> Self::Output {
            (T::TOPIC, T::LAYOUT)
        }
    }

    #[test]
    fn topics_are_found_by_name_and_family() {
        assert_eq!(visit_topic("sonar/ranges", &mut Name).map(|t| t.0), Some("sonar/ranges"));
        assert_eq!(visit_topic("health/pilot", &mut Name).map(|t| t.0), Some("health"));
        assert!(visit_topic("health", &mut Name).is_some());
        assert!(visit_topic("health/", &mut Name).is_none());
        assert!(visit_topic("sonar", &mut Name).is_none());
    }

    #[test]
    fn no_two_topics_share_a_name_or_a_layout() {
        struct All(Vec<(&'static str, u64)>);
        impl TopicVisitor for All {
            type Output = ();
            fn visit<T: Message>(&mut self) {
                self.0.push((T::TOPIC, T::LAYOUT));
            }
        }
        let mut all = All(Vec::new());
        visit_all(&mut all);
        for (i, a) in all.0.iter().enumerate() {
            for b in &all.0[..i] {
                assert_ne!(a.0, b.0);
                assert_ne!(a.1, b.1, "{} and {}", a.0, b.0);
            }
        }
    }

    #[test]
    fn json_is_json_and_hides_reserved_fields() {
        use crate::Field;
        let mut text = String::new();
        let mut pose = Pose { x_m: 1.5, heading_rad: f32::NAN, ..Default::default() };
        pose.header.sequence = 7;
        assert!(pose.write_json(&mut text).is_ok());
        assert!(text.starts_with("{\"header\":{\"stamp_ns\":0,\"sequence\":7"), "{text}");
        assert!(text.contains("\"x_m\":1.5") && text.contains("\"heading_rad\":null"), "{text}");
        assert!(!text.contains("reserved"), "{text}");
    }
}
