//! The operator: what is heard of it in a tick, and what of that the team may do.
//!
//! Whoever drives says again and again how the object shall move. Ticks since it last spoke are counted, and no clock
//! is read: after too many of them the object brakes, so early that it is at rest when the time is over within which
//! it must be. Speeds, heights and tilts are bounded here, where nobody gets round them.

use crate::build::{BuildCoordinatorError, find_row};
use bytemuck::{Pod, Zeroable};
use mikoshi_config::scenario::{DriveLimits, OperatorEvent, OperatorWord, Scenario};
use mikoshi_cooperation::{Control, GeneralizedForce, HybridLaw};
use mikoshi_ipc_types::{Drive, OperatorInput, operator};
use mikoshi_spatial::{Object, Pose, Twist, World};
use nalgebra::{UnitQuaternion, Vector2, Vector3};

/// What may be asked for, and what a script says. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Operator {
    drive: Option<Bounds>,
    /// Words of a job mean something.
    has_job: bool,
    /// By tick.
    script: Vec<(u64, OperatorEvent)>,
}

#[derive(Clone, Debug)]
struct Bounds {
    limits: DriveLimits,
    /// For how many ticks silence is bridged.
    silence_ticks: u64,
    squeeze: Option<SqueezeAxis>,
}

/// The internal force that may be raised.
#[derive(Clone, Copy, Debug)]
struct SqueezeAxis {
    /// Among the internal ones.
    row: usize,
    axis: usize,
    max_n: f64,
    step_n: f64,
}

/// What is remembered between ticks.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct OperatorState {
    /// The last word.
    pub word: u64,
    /// The last message of whoever drives.
    pub drive: Drive,
    /// One past the tick in which it was heard first; 0 before the first.
    next_tick: u64,
    /// The last word about the job that has not been followed yet; 0 if none.
    pub asked: u64,
    /// How much harder the hands press by now.
    pub squeeze_n: f64,
    /// Where driving began.
    home: [f64; 3],
    /// Not 0 after a stop, until whoever drives has wanted rest or has fallen silent: nothing moves by itself.
    must_rest: u64,
}

/// What is said in a tick to the team as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Says {
    pub stop: bool,
    pub resume: bool,
}

/// What whoever drives wants, and for how long it has said nothing new.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Voice {
    drive: Drive,
    silent_ticks: u64,
}

impl Operator {
    /// As the scenario has it.
    pub(crate) fn new(scenario: &Scenario, law: &HybridLaw) -> Result<Self, BuildCoordinatorError> {
        let drive = scenario.operator.drive.as_ref().map(|limits| Bounds::new(limits, scenario, law));
        let script = scenario.operator.script.iter().map(|event| (scenario.tick_at(event.at_s), *event));
        let mut script: Vec<_> = script.collect();
        script.sort_by_key(|(tick, _)| *tick);
        Ok(Self { drive: drive.transpose()?, has_job: scenario.job.is_some(), script })
    }

    /// Whether somebody may drive: then nothing else moves the object.
    pub(crate) fn is_driven(&self) -> bool {
        self.drive.is_some()
    }

    /// One tick: takes in what is heard, and what the script says.
    pub(crate) fn listen(&self, state: &mut OperatorState, heard: &OperatorInput, tick: u64) -> Says {
        let mut says = Says::default();
        let last = core::mem::replace(&mut state.word, heard.word);
        if last != heard.word {
            says.stop |= operator::stops_of(last) != operator::stops_of(heard.word);
            self.take_word(state, &mut says, operator::command_of(heard.word));
        }
        if heard.drive.number != state.drive.number {
            (state.drive, state.next_tick) = (heard.drive, tick + 1);
        }
        for (_, event) in self.script.iter().filter(|(at, _)| *at == tick) {
            self.take_word(state, &mut says, command_of(event.says));
        }
        if says.stop {
            state.asked = 0;
        }
        if self.speaks(state, tick).is_none_or(|voice| voice.drive.twist == [0.0; 6]) {
            state.must_rest = 0;
        }
        says
    }

    /// Takes note that the team is stopped.
    pub(crate) fn rest(&self, state: &mut OperatorState) {
        state.must_rest = 1;
    }

    fn take_word(&self, state: &mut OperatorState, says: &mut Says, command: u64) {
        match command {
            operator::STOP => says.stop = true,
            operator::RESUME => says.resume = true,
            operator::GRASP | operator::LIFT | operator::LOWER | operator::RELEASE if self.has_job => {
                state.asked = command;
            }
            _ => {}
        }
    }

    /// For how many ticks whoever drives has said nothing new; 0 where nobody ever drove.
    pub(crate) fn silent_ticks(&self, state: &OperatorState, tick: u64) -> u64 {
        self.voice(state, tick).map_or(0, |voice| voice.silent_ticks)
    }

    /// The twist that the object at `X_WA` is to have, by what was said; `None` where nobody may drive.
    pub(crate) fn wanted(
        &self,
        state: &OperatorState,
        tick: u64,
        X_WA: &Pose<World, Object>,
    ) -> Option<Twist<World>> {
        let bounds = self.drive.as_ref()?;
        // To be set down it comes to rest.
        let may_move = state.must_rest == 0 && state.asked != operator::LOWER;
        let voice = self.speaks(state, tick).filter(|_| may_move);
        Some(voice.map_or_else(Twist::zero, |voice| bounds.wanted(&voice.drive, X_WA, &state.home)))
    }

    /// One tick of the squeeze: on its way to what was asked for, or where hands are about to let go, to nothing.
    /// Silence leaves it as it is: a hand that lets go is no safer.
    pub(crate) fn squeeze(&self, state: &mut OperatorState, tick: u64, is_to_let_go: bool) {
        let Some(SqueezeAxis { max_n, step_n, .. }) = self.drive.as_ref().and_then(|bounds| bounds.squeeze)
        else {
            return;
        };
        let asked_n = self.voice(state, tick).map_or(0.0, |voice| voice.drive.squeeze_n.clamp(0.0, max_n));
        let target_n = if is_to_let_go { 0.0 } else { asked_n };
        state.squeeze_n += (target_n - state.squeeze_n).clamp(-step_n, step_n);
    }

    /// Adds the squeeze to the references of forces.
    pub(crate) fn add_squeeze(&self, state: &OperatorState, force: &mut GeneralizedForce) {
        let Some(SqueezeAxis { row, axis, .. }) = self.drive.as_ref().and_then(|bounds| bounds.squeeze)
        else {
            return;
        };
        if let Some(reference) = force.internal.get_mut(row).and_then(|row| row.force.get_mut(axis)) {
            *reference += state.squeeze_n;
        }
    }

    /// Driving begins, or begins again, with the object here.
    pub(crate) fn begin(&self, state: &mut OperatorState, pose: &[f64; 7]) {
        let [x, y, z, ..] = *pose;
        state.home = [x, y, z];
    }

    /// The same, as long as silence is bridged.
    fn speaks(&self, state: &OperatorState, tick: u64) -> Option<Voice> {
        let silence_ticks = self.drive.as_ref()?.silence_ticks;
        self.voice(state, tick).filter(|voice| voice.silent_ticks <= silence_ticks)
    }

    fn voice(&self, state: &OperatorState, tick: u64) -> Option<Voice> {
        let speaks =
            |event: &OperatorEvent| matches!(event.says, OperatorWord::Drive | OperatorWord::Silence);
        let mut past = self.script.iter().rev().filter(|(at, event)| *at <= tick && speaks(event));
        match past.next() {
            Some((_, event)) if event.says == OperatorWord::Drive => {
                Some(Voice { drive: drive_of(event), silent_ticks: 0 })
            }
            Some((since, _)) => {
                let last = past.find(|(_, event)| event.says == OperatorWord::Drive);
                last.map(|(_, event)| Voice { drive: drive_of(event), silent_ticks: tick + 1 - since })
            }
            None => (state.next_tick > 0).then(|| Voice {
                drive: state.drive,
                silent_ticks: (tick + 1).saturating_sub(state.next_tick),
            }),
        }
    }
}

fn drive_of(event: &OperatorEvent) -> Drive {
    let ([vx, vy, vz], [wx, wy, wz]) = (event.velocity_m_s, event.angular_velocity_rad_s);
    Drive { number: 0, twist: [vx, vy, vz, wx, wy, wz], squeeze_n: event.squeeze_n }
}

fn command_of(word: OperatorWord) -> u64 {
    match word {
        OperatorWord::Stop => operator::STOP,
        OperatorWord::Resume => operator::RESUME,
        OperatorWord::Grasp => operator::GRASP,
        OperatorWord::Lift => operator::LIFT,
        OperatorWord::Lower => operator::LOWER,
        OperatorWord::Release => operator::RELEASE,
        OperatorWord::Drive | OperatorWord::Silence => 0,
    }
}

impl Bounds {
    fn new(
        limits: &DriveLimits,
        scenario: &Scenario,
        law: &HybridLaw,
    ) -> Result<Self, BuildCoordinatorError> {
        let period_s = scenario.control_period_s;
        let squeeze = limits.squeeze.as_ref().map(|squeeze| {
            let axis = squeeze.axis as usize;
            let row = find_row(law.internal_forces(), &squeeze.row)?;
            let controls = law.parameters().selection.rows().get(row).and_then(|row| row.get(axis));
            match row.checked_sub(1).filter(|_| controls == Some(&Control::Force)) {
                Some(row) => {
                    let (max_n, step_n) = (squeeze.max_n, squeeze.rate_n_s * period_s);
                    Ok(SqueezeAxis { row, axis, max_n, step_n })
                }
                None => Err(BuildCoordinatorError::Squeeze { found: squeeze.row.clone() }),
            }
        });
        // The tick in which silence is noticed, and that in which the last of the speed is lost.
        let silence_ticks = (limits.silence_s() / period_s).floor() as u64;
        Ok(Self {
            limits: limits.clone(),
            silence_ticks: silence_ticks.saturating_sub(2),
            squeeze: squeeze.transpose()?,
        })
    }

    /// What is asked for, in the world and within all bounds.
    fn wanted(&self, drive: &Drive, X_WA: &Pose<World, Object>, home: &[f64; 3]) -> Twist<World> {
        let limits = &self.limits;
        let [vx, vy, vz, wx, wy, wz] = drive.twist;
        let (ahead, up) = (X_WA.rotation * Vector3::x(), X_WA.rotation * Vector3::z());
        let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), ahead.y.atan2(ahead.x));
        let to_world = |x, y| (heading * Vector3::new(x, y, 0.0)).xy();
        let [x, y, z] = *home;
        let away = X_WA.translation - Vector3::new(x, y, z);
        let (braking, turning) = (0.5 * limits.braking_m_s2, 0.5 * limits.angular_braking_rad_s2);

        let level = at_most(to_world(vx, vy), limits.velocity_max_m_s);
        let level = match limits.range_m {
            Some(range_m) => within(away.xy(), level, range_m, braking),
            None => level,
        };
        let rising = vz.clamp(-limits.vertical_max_m_s, limits.vertical_max_m_s);
        let rising = within(Vector2::new(0.0, away.z), Vector2::new(0.0, rising), limits.height_m, braking).y;
        // How the object leans: the rotation that takes the vertical to its own.
        let lean = Vector3::z().cross(&up).xy();
        let tilting = at_most(to_world(wx, wy), limits.tilt_rate_max_rad_s);
        let tilting = within(lean, tilting, limits.tilt_rad, turning);
        let yaw_rate = wz.clamp(-limits.yaw_rate_max_rad_s, limits.yaw_rate_max_rad_s);
        Twist::new(level.push(rising), tilting.push(yaw_rate))
    }
}

fn at_most(vector: Vector2<f64>, most: f64) -> Vector2<f64> {
    let length = vector.norm();
    if length > most { vector * (most / length) } else { vector }
}

/// The velocity with which something at `place` does not leave the circle of this radius: outwards at most
/// √(2 a d), from which it stops in the room d that is left.
fn within(place: Vector2<f64>, velocity: Vector2<f64>, radius: f64, braking: f64) -> Vector2<f64> {
    let Some(outwards) = place.try_normalize(1e-9) else { return velocity };
    let most = (2.0 * braking * (radius - place.norm()).max(0.0)).sqrt();
    velocity - outwards * (velocity.dot(&outwards) - most).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds() -> Bounds {
        let limits = DriveLimits { range_m: Some(1.0), ..DriveLimits::default() };
        Bounds {
            limits,
            silence_ticks: 50,
            squeeze: Some(SqueezeAxis { row: 0, axis: 0, max_n: 30.0, step_n: 0.5 }),
        }
    }

    fn operator(script: Vec<(u64, OperatorEvent)>) -> Operator {
        Operator { drive: Some(bounds()), has_job: true, script }
    }

    fn saying(number: u64, twist: [f64; 6]) -> OperatorInput {
        OperatorInput { drive: Drive { number, twist, squeeze_n: 0.0 }, ..OperatorInput::default() }
    }

    const AHEAD: [f64; 6] = [0.05, 0.0, 0.0, 0.0, 0.0, 0.0];

    #[test]
    fn whoever_drives_is_followed_as_long_as_it_speaks() {
        let (operator, mut state) = (operator(vec![]), OperatorState::default());
        let at = Pose::identity();
        assert_eq!(operator.wanted(&state, 0, &at), Some(Twist::zero()));
        for tick in 0..100 {
            operator.listen(&mut state, &saying(1 + tick / 10, AHEAD), tick);
            assert_eq!(operator.wanted(&state, tick, &at).map(|twist| twist.to_array()), Some(AHEAD));
        }
        // Its last message was heard in tick 90.
        for tick in 100..200 {
            operator.listen(&mut state, &saying(10, AHEAD), tick);
            let expected = if tick <= 140 { AHEAD } else { [0.0; 6] };
            let wanted = operator.wanted(&state, tick, &at).map(|twist| twist.to_array());
            assert_eq!(wanted, Some(expected), "tick {tick}");
            assert_eq!(operator.silent_ticks(&state, tick), tick - 90);
        }
    }

    #[test]
    fn after_a_stop_nothing_moves_before_whoever_drives_has_wanted_rest() {
        let (operator, mut state) = (operator(vec![]), OperatorState::default());
        let mut speed = |number, twist, is_stopped| {
            operator.listen(&mut state, &saying(number, twist), number);
            if is_stopped {
                operator.rest(&mut state);
            }
            operator.wanted(&state, number, &Pose::identity()).expect("it is driven").linear.x
        };
        assert_eq!(speed(1, AHEAD, false), 0.05);
        assert_eq!(speed(2, AHEAD, true), 0.0);
        assert_eq!(speed(3, AHEAD, false), 0.0);
        assert_eq!(speed(4, [0.0; 6], false), 0.0);
        assert_eq!(speed(5, AHEAD, false), 0.05);
    }

    #[test]
    fn a_script_that_falls_silent_is_bridged_as_long() {
        let event = |says, vx| OperatorEvent {
            at_s: 0.0,
            says,
            velocity_m_s: [vx, 0.0, 0.0],
            angular_velocity_rad_s: [0.0; 3],
            squeeze_n: 0.0,
        };
        let operator =
            operator(vec![(10, event(OperatorWord::Drive, 0.05)), (20, event(OperatorWord::Silence, 0.0))]);
        let speed = |tick| {
            let wanted = operator.wanted(&OperatorState::default(), tick, &Pose::identity());
            wanted.expect("it is driven").linear.x
        };
        assert_eq!([9, 10, 19, 20, 69, 70].map(speed), [0.0, 0.05, 0.05, 0.05, 0.05, 0.0]);
    }

    #[test]
    fn ahead_is_where_the_object_faces() {
        let (operator, mut state) = (operator(vec![]), OperatorState::default());
        operator.listen(&mut state, &saying(1, AHEAD), 0);
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), core::f64::consts::FRAC_PI_2);
        let at = Pose::new(Vector3::zeros(), turned);
        let wanted = operator.wanted(&state, 0, &at).expect("it is driven");
        assert!((wanted.linear - Vector3::new(0.0, 0.05, 0.0)).norm() < 1e-12, "{wanted:?}");
    }

    #[test]
    fn nobody_drives_faster_than_is_allowed() {
        let wanted = bounds().wanted(
            &Drive { number: 1, twist: [3.0, -4.0, -9.0, 9.0, 0.0, 9.0], squeeze_n: 0.0 },
            &Pose::identity(),
            &[0.0; 3],
        );
        let limits = DriveLimits::default();
        let most = limits.velocity_max_m_s;
        let expected = [
            0.6 * most,
            -0.8 * most,
            -limits.vertical_max_m_s,
            limits.tilt_rate_max_rad_s,
            0.0,
            limits.yaw_rate_max_rad_s,
        ];
        let apart = wanted.to_vector() - nalgebra::Vector6::from(expected);
        assert!(apart.norm() < 1e-12, "{wanted:?}");
    }

    #[test]
    fn nobody_drives_further_than_is_allowed() {
        let bounds = bounds();
        let drive = Drive { number: 1, twist: [1.0, 1.0, 1.0, 1.0, 1.0, 0.0], squeeze_n: 0.0 };
        let mut at = Pose::<World, Object>::identity();
        for _ in 0..100_000 {
            at = at.displaced(&(bounds.wanted(&drive, &at, &[0.0; 3]) * 0.005));
        }
        let lean = Vector3::z().angle(&(at.rotation * Vector3::z()));
        assert!((at.translation.xy().norm() - 1.0).abs() < 1e-3, "{at:?}");
        assert!((at.translation.z - 0.02).abs() < 1e-4 && (lean - 0.03).abs() < 1e-4, "{at:?}");
        // And back.
        let back = Drive { twist: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], ..drive };
        assert!(bounds.wanted(&back, &at, &[0.0; 3]).linear.x < -0.05);
    }

    #[test]
    fn words_are_heard_once_and_those_of_a_job_wait() {
        let (operator, mut state) = (operator(vec![]), OperatorState::default());
        let mut heard = OperatorInput::default();
        let mut say = |state: &mut OperatorState, commands: &[u64]| {
            for command in commands {
                heard.word = operator::word_after(heard.word, *command);
            }
            let says = operator.listen(state, &heard, 0);
            assert_eq!(operator.listen(state, &heard, 1), Says::default(), "a word is heard once");
            says
        };
        assert_eq!(say(&mut state, &[operator::GRASP]), Says::default());
        assert_eq!(state.asked, operator::GRASP);
        assert_eq!(say(&mut state, &[operator::RESUME]), Says { stop: false, resume: true });
        assert_eq!(state.asked, operator::GRASP);
        let both = say(&mut state, &[operator::STOP, operator::LIFT]);
        assert_eq!((both, state.asked), (Says { stop: true, resume: false }, 0));
    }

    #[test]
    fn hands_press_harder_by_and_by_and_no_harder_than_they_may() {
        let (operator, mut state) = (operator(vec![]), OperatorState::default());
        let drive = Drive { number: 1, twist: [0.0; 6], squeeze_n: 1e9 };
        operator.listen(&mut state, &OperatorInput { drive, ..OperatorInput::default() }, 0);
        for tick in 0..100 {
            operator.squeeze(&mut state, tick, false);
            assert_eq!(state.squeeze_n, (0.5 * (tick + 1) as f64).min(30.0));
        }
        for tick in 100..1000 {
            operator.squeeze(&mut state, tick, false);
        }
        assert_eq!(state.squeeze_n, 30.0, "nobody lets go because nobody drives");
        for tick in 1000..1100 {
            operator.squeeze(&mut state, tick, true);
        }
        assert_eq!(state.squeeze_n, 0.0);
    }
}
