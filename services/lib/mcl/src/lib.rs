//! Monte Carlo localization on ultrasonic cones.
#![forbid(unsafe_code)]
