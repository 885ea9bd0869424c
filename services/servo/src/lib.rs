//! One robot's controller: one process per robot, pure tick.
