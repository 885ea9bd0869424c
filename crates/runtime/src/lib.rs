//! Tick schedules, clocks, transports, waiting, domains, affinity.
