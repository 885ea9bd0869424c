//! The mikoshi command: run, plan, status, doctor.
