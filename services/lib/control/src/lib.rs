//! Flight control laws, the shield, arbitration and the failsafe table.
#![forbid(unsafe_code)]
