//! The physical world: MuJoCo behind Mikoshi's frames.
