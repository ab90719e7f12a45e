//! Local obstacle avoidance: the Vector Field Histogram.
#![forbid(unsafe_code)]
