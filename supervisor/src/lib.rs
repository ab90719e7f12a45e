//! Creates and holds all shared memory, keeps retained state, spawns, watches, reaps, restarts.
