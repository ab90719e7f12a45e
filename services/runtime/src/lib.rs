//! How a process lives: typed ports, clock, heartbeat, configuration, logging, shutdown.
