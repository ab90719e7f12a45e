//! MultiWii Serial Protocol, versions 1 and 2.
#![no_std]
#![forbid(unsafe_code)]
