//! Hosts, their links and what is between them: a team walks, is cut off, is attacked, and what it says is what it says
//! on one host.
//!
//! Hosts are namespaces of this machine, cables are packets that a thread of the test delays and loses. Where that is
//! not allowed (root, namespaces, /dev/net/tun) the tests say so, and judge nothing.

mod attacks;
mod certificates;
mod cuts;
mod hosts;
mod lockstep;
mod replaced;
mod team;
mod walk;
mod ways;
mod wire;

/// Ends the test with a word where hosts can't be had.
#[macro_export]
macro_rules! or_skip {
    ($started:expr $(, $result:expr)?) => {
        match $started {
            Ok(started) => started,
            Err($crate::hosts::Lacking(what)) => {
                eprintln!("skipped: no hosts of its own: {what}");
                return $($result)?;
            }
        }
    };
}
