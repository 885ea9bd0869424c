//! How long frames take from service to service, and services from input to output, by the stamps that they carry.

use crate::canonical::Observation;
use core::fmt;
use hdrhistogram::Histogram;
use mikoshi_ipc_types::{Envelope, Frame, Payload};
use serde::{Deserialize, Serialize};

/// Times are told apart to a thousandth of themselves, up to a minute.
const SIGNIFICANT_DIGITS: u8 = 3;
const LONGEST_NS: u64 = 60_000_000_000;
/// Ticks of which all is kept.
const WORST_TICKS: usize = 10;
/// Late ticks that are remembered; more than that is no measurement any more.
const MAX_LATE_TICKS: usize = 100_000;
/// A tick that begins so much of a period after it was due is late.
const LATE: f64 = 0.1;

/// A histogram of times, empty. What it occupies does not grow with what it holds.
pub fn times_ns() -> Histogram<u64> {
    Histogram::new_with_max(LONGEST_NS, SIGNIFICANT_DIGITS).expect("bounds that a histogram can have")
}

/// A part of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Span {
    /// From sensors that were published to the servo that heard them.
    BridgeToServo,
    /// What a servo makes of its sensors, and keeps.
    Sense,
    /// From the last robot's state to the coordinator that heard all.
    ServoToCoordinator,
    /// What the coordinator makes of all states, and keeps.
    Coordinate,
    /// From the team's command to the servo that heard it, where it waits for it.
    CoordinatorToServo,
    /// What a servo makes of its command, and keeps.
    Act,
    /// From the last robot's command to the bridge that heard all.
    ServoToBridge,
    /// A step of the world, and keeping it.
    Step,
    /// From a result that was kept to the frame that says it.
    Publish,
    /// From the sensors of a tick to all joint commands that come of them.
    SensorsToCommands,
    /// From a tick's sensors to the next one's.
    Tick,
    /// From when a tick was due to its sensors: waking up, and reading them.
    WakeUp,
}

impl Span {
    /// All, in the order of a tick.
    pub const ALL: [Self; 12] = [
        Self::BridgeToServo,
        Self::Sense,
        Self::ServoToCoordinator,
        Self::Coordinate,
        Self::CoordinatorToServo,
        Self::Act,
        Self::ServoToBridge,
        Self::Step,
        Self::Publish,
        Self::SensorsToCommands,
        Self::Tick,
        Self::WakeUp,
    ];
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::BridgeToServo => "bridge → servo",
            Self::Sense => "servo senses",
            Self::ServoToCoordinator => "servo → coordinator",
            Self::Coordinate => "coordinator",
            Self::CoordinatorToServo => "coordinator → servo",
            Self::Act => "servo acts",
            Self::ServoToBridge => "servo → bridge",
            Self::Step => "bridge steps",
            Self::Publish => "publishing",
            Self::SensorsToCommands => "sensors → commands",
            Self::Tick => "tick",
            Self::WakeUp => "waking up",
        })
    }
}

/// Gathers the times of a run.
#[derive(Clone, Debug)]
pub struct LatencyFigures {
    period_ns: f64,
    /// Whether servos wait for the command of the same tick.
    waits_for_command: bool,
    /// In the ticks before, memory is touched for the first time.
    warm_up_ticks: u64,
    histograms: Vec<Histogram<u64>>,
    last: Option<Observation>,
    worst: Vec<WorstTick>,
    late: Vec<LateTick>,
    ticks: u64,
}

/// The distribution of one span \[ns\].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct SpanSummary {
    pub span: Span,
    pub count: u64,
    pub mean_ns: f64,
    pub p50_ns: u64,
    pub p90_ns: u64,
    pub p99_ns: u64,
    pub p999_ns: u64,
    pub max_ns: u64,
    /// Share of all that took longer than so many nanoseconds: what a plot of the tail shows.
    pub tail: Vec<(u64, f64)>,
}

/// What ran when in a tick that took long.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct WorstTick {
    pub tick: u64,
    pub took_ns: u64,
    /// When its sensors were published, on the machine's monotonic clock.
    pub at_ns: u64,
    pub phases: Vec<PhaseTimes>,
}

/// When one phase of a tick did what, from the tick's sensors on \[ns\].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct PhaseTimes {
    pub service: String,
    pub robot: Option<usize>,
    pub heard_ns: i64,
    pub kept_ns: i64,
    pub said_ns: i64,
}

/// A tick that began late: its times on the machine's monotonic clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LateTick {
    /// Which.
    pub tick: u64,
    /// When it was to begin.
    pub due_ns: u64,
    /// When the bridge had heard, or done without, the commands of the tick before.
    pub heard_ns: u64,
    /// When it had stepped the world, and could have begun.
    pub ready_ns: u64,
    /// When it began.
    pub began_ns: u64,
    /// For how long between due and beginning another service was busy with the tick before.
    pub others_busy_ns: u64,
}

impl LateTick {
    /// Whether it was due before the world had been stepped; else the bridge was ready, and woke up late.
    pub fn is_overrun(&self) -> bool {
        self.ready_ns > self.due_ns
    }
}

impl LatencyFigures {
    /// Of a run with this control period, in which commands are so many ticks old; its first ticks don't count.
    pub fn new(control_period_s: f64, coordination_delay_ticks: u64, warm_up_ticks: u64) -> Self {
        let histograms = Span::ALL.iter().map(|_| times_ns()).collect();
        Self {
            period_ns: control_period_s * 1e9,
            waits_for_command: coordination_delay_ticks == 0,
            warm_up_ticks,
            histograms,
            last: None,
            worst: vec![],
            late: vec![],
            ticks: 0,
        }
    }

    /// Takes in one tick.
    pub fn observe(&mut self, observation: &Observation) {
        if let Some(last) = self.last.take()
            && last.tick() + 1 == observation.tick()
            && last.tick() >= self.warm_up_ticks
        {
            self.ticks += 1;
            self.take_tick(&last, observation);
        }
        self.last = Some(observation.clone());
    }

    fn record(&mut self, span: Span, from_ns: u64, to_ns: u64) {
        // Where no clock was read, and where a frame was lost, there is nothing to tell.
        if from_ns > 0 && to_ns >= from_ns {
            self.histograms[span as usize].saturating_record(to_ns - from_ns);
        }
    }

    fn record_phase(&mut self, span: Span, phase: &Envelope) {
        self.record(span, phase.heard_ns, phase.kept_ns);
        self.record(Span::Publish, phase.kept_ns, phase.stamp_ns);
    }

    fn take_tick(&mut self, tick: &Observation, next: &Observation) {
        let robots = tick.sensors.len();
        for robot in 0..robots {
            let sensors = of_tick(tick, &tick.sensors[robot]);
            let state = of_tick(tick, &tick.robot_state[robot]);
            if let Some(state) = state {
                self.record_phase(Span::Sense, &state);
                if let Some(sensors) = sensors {
                    self.record(Span::BridgeToServo, sensors.stamp_ns, state.heard_ns);
                }
            }
            if let Some(joints) = of_tick(tick, &tick.joint_command[robot]) {
                self.record_phase(Span::Act, &joints);
                if let Some(command) =
                    of_tick(tick, &tick.team_command[robot]).filter(|_| self.waits_for_command)
                {
                    self.record(Span::CoordinatorToServo, command.stamp_ns, joints.heard_ns);
                }
            }
        }
        if let Some(team) = of_tick(tick, &tick.team_state) {
            self.record_phase(Span::Coordinate, &team);
            self.record(Span::ServoToCoordinator, last_stamp(tick, &tick.robot_state), team.heard_ns);
        }
        let (Some(first), Some(then)) = (of_tick(tick, &tick.sensors[0]), of_tick(next, &next.sensors[0]))
        else {
            return;
        };
        self.record(Span::ServoToBridge, last_stamp(tick, &tick.joint_command), then.heard_ns);
        self.record(Span::Step, then.heard_ns, then.kept_ns);
        self.record(Span::SensorsToCommands, first.stamp_ns, then.heard_ns);
        self.record(Span::Tick, first.stamp_ns, then.stamp_ns);
        self.record(Span::WakeUp, first.due_ns, first.stamp_ns);
        let is_late = then.due_ns > 0
            && then.stamp_ns.saturating_sub(then.due_ns) as f64 > LATE * self.period_ns
            && self.late.len() < MAX_LATE_TICKS;
        if is_late {
            self.late.push(LateTick {
                tick: next.tick(),
                due_ns: then.due_ns,
                heard_ns: then.heard_ns,
                ready_ns: then.kept_ns,
                began_ns: then.stamp_ns,
                others_busy_ns: busy_ns(tick, then.due_ns, then.stamp_ns),
            });
        }
        self.keep_if_bad(tick, &first, &then);
    }

    /// By the clock a tick is bad if it began late, in lockstep if it took long.
    fn keep_if_bad(&mut self, tick: &Observation, first: &Envelope, then: &Envelope) {
        let took_ns = match first.due_ns {
            0 => then.stamp_ns.saturating_sub(first.stamp_ns),
            due_ns => then.heard_ns.saturating_sub(due_ns),
        };
        let is_worse = self.worst.last().is_none_or(|least| took_ns > least.took_ns);
        if self.worst.len() == WORST_TICKS && !is_worse {
            return;
        }
        let place = self.worst.partition_point(|worse| worse.took_ns >= took_ns);
        let (number, at_ns) = (tick.tick(), first.stamp_ns);
        self.worst.insert(place, WorstTick { tick: number, took_ns, at_ns, phases: phases_of(tick, then) });
        self.worst.truncate(WORST_TICKS);
    }

    /// Ticks that were measured.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Ticks that began late, in their order.
    pub fn late(&self) -> &[LateTick] {
        &self.late
    }

    /// Those that were worst, the worst first.
    pub fn worst(&self) -> &[WorstTick] {
        &self.worst
    }

    /// The distributions of all spans that were seen.
    pub fn spans(&self) -> Vec<SpanSummary> {
        let seen = Span::ALL.into_iter().zip(&self.histograms).filter(|(_, histogram)| !histogram.is_empty());
        seen.map(|(span, histogram)| SpanSummary::of(span, histogram)).collect()
    }
}

impl SpanSummary {
    /// Of times \[ns\].
    pub fn of(span: Span, histogram: &Histogram<u64>) -> Self {
        let at = |share| histogram.value_at_quantile(share);
        let count = histogram.len();
        let tail = histogram.iter_quantiles(2).filter(|point| point.count_since_last_iteration() > 0);
        Self {
            span,
            count,
            mean_ns: histogram.mean(),
            p50_ns: at(0.5),
            p90_ns: at(0.9),
            p99_ns: at(0.99),
            p999_ns: at(0.999),
            max_ns: histogram.max(),
            tail: tail.map(|point| (point.value_iterated_to(), 1.0 - point.quantile())).collect(),
        }
    }
}

/// The envelope of a frame that belongs to the tick; none if it was lost.
fn of_tick<P: Payload>(tick: &Observation, frame: &Frame<P>) -> Option<Envelope> {
    tick.is_of_tick(frame).then_some(frame.envelope)
}

/// When the last robot's frame of the tick was published; 0 if one was lost.
fn last_stamp<P: Payload>(tick: &Observation, frames: &[Frame<P>]) -> u64 {
    let stamps = frames.iter().map(|frame| of_tick(tick, frame).map(|envelope| envelope.stamp_ns));
    stamps.collect::<Option<Vec<_>>>().and_then(|stamps| stamps.into_iter().max()).unwrap_or_default()
}

/// For how long between these times some service but the bridge was at work on this tick.
fn busy_ns(tick: &Observation, from_ns: u64, to_ns: u64) -> u64 {
    let work = |phase: &Envelope| (phase.heard_ns.max(from_ns), phase.stamp_ns.min(to_ns));
    let states = tick.robot_state.iter().map(|frame| work(&frame.envelope));
    let commands = tick.joint_command.iter().map(|frame| work(&frame.envelope));
    let mut times: Vec<_> = states.chain(commands).chain([work(&tick.team_state.envelope)]).collect();
    times.sort_unstable();
    let mut until_ns = from_ns;
    times.into_iter().fold(0, |busy_ns, (begin_ns, end_ns)| {
        let new_ns = end_ns.saturating_sub(begin_ns.max(until_ns));
        until_ns = until_ns.max(end_ns);
        busy_ns + new_ns
    })
}

fn phases_of(tick: &Observation, then: &Envelope) -> Vec<PhaseTimes> {
    let begin_ns = tick.sensors[0].envelope.stamp_ns;
    let from = |at_ns: u64| if at_ns == 0 { 0 } else { at_ns.wrapping_sub(begin_ns) as i64 };
    let mut phases = vec![];
    let mut put = |service: &str, robot: Option<usize>, envelope: &Envelope| {
        phases.push(PhaseTimes {
            service: service.to_owned(),
            robot,
            heard_ns: from(envelope.heard_ns),
            kept_ns: from(envelope.kept_ns),
            said_ns: from(envelope.stamp_ns),
        });
    };
    for (robot, frame) in tick.robot_state.iter().enumerate() {
        put("servo senses", Some(robot), &frame.envelope);
    }
    put("coordinator", None, &tick.team_state.envelope);
    for (robot, frame) in tick.joint_command.iter().enumerate() {
        put("servo acts", Some(robot), &frame.envelope);
    }
    put("bridge steps", None, then);
    phases
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 5_000_000;

    /// A tick of two robots in which everything takes a time of its own.
    fn tick(number: u64, begin_ns: u64, due_ns: u64) -> Observation {
        let mut all = Observation::for_team(2);
        let stamp = |envelope: &mut Envelope, heard_ns: u64, kept_ns: u64, stamp_ns: u64| {
            let at = |offset_ns: u64| begin_ns + offset_ns;
            (envelope.tick, envelope.due_ns) = (number, due_ns);
            (envelope.heard_ns, envelope.kept_ns, envelope.stamp_ns) =
                (at(heard_ns), at(kept_ns), at(stamp_ns));
        };
        let before = |ns: u64| 0_u64.wrapping_sub(ns);
        for sensors in &mut all.sensors {
            // Commands were heard 700 µs before, the step took 600 µs.
            (sensors.envelope.tick, sensors.envelope.due_ns) = (number, due_ns);
            sensors.envelope.heard_ns = begin_ns.wrapping_add(before(700_000));
            sensors.envelope.kept_ns = begin_ns.wrapping_add(before(100_000));
            sensors.envelope.stamp_ns = begin_ns;
        }
        stamp(&mut all.object_truth.envelope, 0, 0, 0);
        stamp(&mut all.robot_state[0].envelope, 1_000, 31_000, 32_000);
        stamp(&mut all.robot_state[1].envelope, 3_000, 33_000, 34_000);
        stamp(&mut all.team_state.envelope, 39_000, 44_000, 45_000);
        for robot in 0..2 {
            stamp(&mut all.team_command[robot].envelope, 39_000, 44_000, 45_000);
            stamp(&mut all.joint_command[robot].envelope, 52_000, 92_000, 93_000);
        }
        all
    }

    fn gathered(ticks: impl Iterator<Item = Observation>) -> LatencyFigures {
        let mut figures = LatencyFigures::new(PERIOD_NS as f64 * 1e-9, 0, 0);
        ticks.for_each(|tick| figures.observe(&tick));
        figures
    }

    fn median_us(figures: &LatencyFigures, span: Span) -> Option<f64> {
        let spans = figures.spans();
        spans.iter().find(|summary| summary.span == span).map(|summary| summary.p50_ns as f64 * 1e-3)
    }

    #[test]
    fn every_span_is_what_its_stamps_say() {
        let period_ns = 800_000;
        let figures = gathered((0..100).map(|number| tick(number, 1_000_000 + number * period_ns, 0)));
        assert_eq!(figures.ticks(), 99);
        let expected = [
            (Span::BridgeToServo, Some(1.0)),
            (Span::Sense, Some(30.0)),
            (Span::ServoToCoordinator, Some(5.0)),
            (Span::Coordinate, Some(5.0)),
            (Span::CoordinatorToServo, Some(7.0)),
            (Span::Act, Some(40.0)),
            (Span::ServoToBridge, Some(7.0)),
            (Span::Step, Some(600.0)),
            (Span::Publish, Some(1.0)),
            (Span::SensorsToCommands, Some(100.0)),
            (Span::Tick, Some(800.0)),
            (Span::WakeUp, None),
        ];
        for (span, median) in expected {
            let found = median_us(&figures, span);
            let is_near = match (found, median) {
                (Some(found), Some(median)) => (found - median).abs() <= 1e-3 * median,
                (found, median) => found == median,
            };
            assert!(is_near, "{span}: {found:?}, expected {median:?}");
        }
    }

    #[test]
    fn late_ticks_and_the_worst_are_remembered_with_what_ran_when() {
        let begin = |number: u64| 1_000_000 + number * PERIOD_NS;
        let ticks = (0..100).map(|number| {
            let late_ns = if number == 40 { 700_000 } else { 20_000 };
            tick(number, begin(number) + late_ns, begin(number))
        });
        let figures = gathered(ticks);
        let expected = LateTick {
            tick: 40,
            due_ns: begin(40),
            heard_ns: begin(40),
            ready_ns: begin(40) + 600_000,
            began_ns: begin(40) + 700_000,
            others_busy_ns: 0,
        };
        assert_eq!(figures.late(), [expected]);
        assert!(expected.is_overrun());
        let worst = &figures.worst()[0];
        assert_eq!((figures.worst().len(), worst.at_ns), (WORST_TICKS, begin(worst.tick) + 20_000));
        assert_eq!(worst.tick, 39, "the next one's commands came late");
        let acts = worst.phases.iter().find(|phase| phase.service == "servo acts").expect("it is there");
        assert_eq!(
            (acts.robot, acts.heard_ns, acts.kept_ns, acts.said_ns),
            (Some(0), 52_000, 92_000, 93_000)
        );
        assert!((median_us(&figures, Span::WakeUp).expect("a clock") - 20.0).abs() < 0.1);
    }

    #[test]
    fn what_others_do_while_a_tick_is_due_is_counted_once() {
        let busy = tick(7, 1_000_000, 0);
        // States take from 1 to 34 µs, the coordinator from 39 to 45, commands from 52 to 93.
        let of = |from_ns: u64, to_ns: u64| busy_ns(&busy, 1_000_000 + from_ns, 1_000_000 + to_ns);
        assert_eq!(of(0, 200_000), 33_000 + 6_000 + 41_000);
        assert_eq!(of(10_000, 20_000), 10_000);
        assert_eq!(of(42_000, 60_000), 3_000 + 8_000);
        assert_eq!(of(100_000, 200_000), 0);
    }

    #[test]
    fn what_was_lost_and_where_no_clock_was_read_tells_nothing() {
        let silent = gathered((0..10).map(|number| {
            let mut all = Observation::for_team(2);
            all.object_truth.envelope.tick = number;
            all.sensors.iter_mut().for_each(|frame| frame.envelope.tick = number);
            all.robot_state.iter_mut().for_each(|frame| frame.envelope.tick = number);
            all.team_state.envelope.tick = number;
            all
        }));
        assert_eq!(silent.spans(), []);
        let lossy = gathered((0..10).map(|number| {
            let mut all = tick(number, 1_000_000 * (number + 1), 0);
            all.robot_state[1].envelope.tick = u64::MAX;
            all
        }));
        // Nobody knows when the last state was there.
        assert_eq!(median_us(&lossy, Span::ServoToCoordinator), None);
        assert!(median_us(&lossy, Span::Sense).is_some());
    }

    #[test]
    fn ticks_of_the_warm_up_do_not_count() {
        let mut figures = LatencyFigures::new(0.005, 0, 50);
        (0..100).for_each(|number| figures.observe(&tick(number, 1_000_000 * (number + 1), 0)));
        assert_eq!(figures.ticks(), 49);
    }
}
