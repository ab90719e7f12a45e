//! What the simulator flies: a quadrotor, its battery, its sonars, the world around it and its flight controller.
#![forbid(unsafe_code)]
