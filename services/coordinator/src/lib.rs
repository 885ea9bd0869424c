//! The team's controller: one process, pure tick.
