//! The plan of the building: occupancy grid, cone and ray casting, distance field, named rooms.
#![forbid(unsafe_code)]
