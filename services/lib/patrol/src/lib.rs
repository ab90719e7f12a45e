//! Coverage of the free space, routes between rooms, the order of a round.
#![forbid(unsafe_code)]
