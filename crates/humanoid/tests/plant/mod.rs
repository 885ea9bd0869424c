//! A robot of one mass on compliant legs: what a position-controlled humanoid does beyond its
//! references.
//!
//! The mass moves on its plane by `c̈ = ω² (c − κ z − γ)`. Its legs follow the commanded centre of mass
//! and soles through springs: each ankle turns (drives, sole, ground), each leg shortens. What the feet
//! press follows from how far the mass has swayed from where the commands would have it, so the pattern
//! alone sags and sways; a foot presses no farther than its edge and never pulls.

use mikoshi_humanoid::balance::{ExternalLoad, Pendulum, PerFoot, Side};
use mikoshi_humanoid::estimate::SoleRectangle;
use mikoshi_spatial::{Foot, Pose, World, Wrench};
use nalgebra::{Vector2, Vector3};

pub struct Plant {
    pub pendulum: Pendulum,
    pub soles: PerFoot<SoleRectangle>,
    pub ankle_nm_rad: f64,
    pub ankle_nms_rad: f64,
    pub leg_n_m: f64,
    pub leg_ns_m: f64,
    pub com: Vector2<f64>,
    pub com_velocity: Vector2<f64>,
    pub ground_wrench: PerFoot<Wrench<World>>,
    pub zmp: Vector2<f64>,
    before: Option<Command>,
}

/// What the drives are told.
#[derive(Clone, Copy)]
pub struct Command {
    pub com: Vector2<f64>,
    /// Where the soles would stand without offsets, while they bear.
    pub standing: PerFoot<Option<Pose<World, Foot>>>,
    /// Tilt of each sole about its own axes.
    pub tilt: PerFoot<Vector2<f64>>,
    /// Height of each sole beside the gait.
    pub height: PerFoot<f64>,
}

impl Plant {
    pub fn new(pendulum: Pendulum, soles: PerFoot<SoleRectangle>, com: Vector2<f64>) -> Self {
        Self {
            pendulum,
            soles,
            ankle_nm_rad: 1500.0,
            ankle_nms_rad: 40.0,
            leg_n_m: 60_000.0,
            leg_ns_m: 1_500.0,
            com,
            com_velocity: Vector2::zeros(),
            ground_wrench: PerFoot::default(),
            zmp: com,
            before: None,
        }
    }

    /// `dt` seconds under `command`, pushed by `push` at the centre of mass \[N\].
    pub fn step(&mut self, command: &Command, push: Vector2<f64>, load: &ExternalLoad, dt: f64) {
        const SUBSTEPS: usize = 10;
        let before = self.before.replace(*command).unwrap_or(*command);
        for substep in 0..SUBSTEPS {
            let share = (substep + 1) as f64 / SUBSTEPS as f64;
            self.substep(&before, command, share, dt, dt / SUBSTEPS as f64, push, load);
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn substep(
        &mut self,
        before: &Command,
        command: &Command,
        share: f64,
        dt: f64,
        h: f64,
        push: Vector2<f64>,
        load: &ExternalLoad,
    ) {
        let between = |a: Vector2<f64>, b: Vector2<f64>| (a + (b - a) * share, (b - a) / dt);
        let height = self.pendulum.com_height_m;
        let (com, com_rate) = between(before.com, command.com);
        // Lean of the body beyond its commands, and its rate [rad], ahead and to the left.
        let lean = (self.com - com) / height;
        let lean_rate = (self.com_velocity - com_rate) / height;

        let feet: Vec<_> = Side::BOTH
            .into_iter()
            .filter_map(|side| command.standing[side].map(|foot| (side, foot)))
            .collect();
        if feet.is_empty() {
            return;
        }
        let middle =
            feet.iter().map(|(_, foot)| foot.translation.xy()).sum::<Vector2<f64>>() / feet.len() as f64;
        let weight = self.pendulum.weight_n() * load.kappa;
        let mut total = 0.0;
        let mut moment = Vector2::zeros();
        self.ground_wrench = PerFoot::default();
        for (side, foot) in &feet {
            let arm = foot.translation.xy() - middle;
            // A lean towards a foot shortens its leg, a sole that reaches lower does too.
            let lower = |command: &Command| -command.height[*side];
            let mean_lower = |command: &Command| {
                feet.iter().map(|(side, _)| -command.height[*side]).sum::<f64>() / feet.len() as f64
            };
            let now = lower(command) - mean_lower(command);
            let then = lower(before) - mean_lower(before);
            let press = lean.dot(&arm) + then + (now - then) * share;
            let press_rate = lean_rate.dot(&arm) + (now - then) / dt;
            let force =
                (weight / feet.len() as f64 + self.leg_n_m * press + self.leg_ns_m * press_rate).max(0.0);

            // Ankle: a lean ahead presses the toe, a sole whose toe is turned down does too. In the
            // world: tilt (about x, about y) moves pressure to (right, ahead).
            let tilt = |command: &Command| {
                let turned = foot.rotation * command.tilt[*side].push(0.0);
                Vector2::new(turned.y, -turned.x)
            };
            let (turned, turned_rate) = between(tilt(before), tilt(command));
            let torque = (lean + turned) * self.ankle_nm_rad + (lean_rate + turned_rate) * self.ankle_nms_rad;
            let arm_in_foot = (foot.rotation.inverse() * torque.push(0.0)).xy() / force.max(1.0);
            let sole = &self.soles[*side];
            let pressure = Vector2::new(
                arm_in_foot.x.clamp(sole.x_min, sole.x_max),
                arm_in_foot.y.clamp(sole.y_min, sole.y_max),
            );
            let offset = (foot.rotation * pressure.push(0.0)).xy();
            self.ground_wrench[*side] = Wrench::new(
                Vector3::new(0.0, 0.0, force),
                Vector3::new(offset.y * force, -offset.x * force, 0.0),
            );
            total += force;
            moment += (foot.translation.xy() + offset) * force;
        }
        if total > 0.0 {
            self.zmp = moment / total;
        }
        let omega = self.pendulum.frequency();
        let acceleration =
            (self.com - load.extended_zmp(&self.zmp)) * (omega * omega) + push / self.pendulum.mass_kg;
        self.com_velocity += acceleration * h;
        self.com += self.com_velocity * h;
    }
}
