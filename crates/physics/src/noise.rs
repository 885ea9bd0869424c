//! What sensors add to the truth.

use crate::random::{Draws, PLACES_OF_NORMAL, Purpose};
use mikoshi_config::scenario::Sensors as SensorsConfig;
use mikoshi_ipc_types::Sensors;

/// How many there are of each kind.
#[derive(Clone, Copy, Debug)]
pub struct SensorCounts {
    /// Encoders.
    pub joints: usize,
    /// Wrist sensors of grasping hands.
    pub hands: usize,
    /// Ankle sensors.
    pub feet: usize,
}

/// What a robot's sensors add to the truth: normal noise, drawn by seed, robot and tick.
pub struct Noise {
    config: SensorsConfig,
    control_period_s: f64,
    draws: Draws,
    counts: SensorCounts,
}

impl Noise {
    /// The noise of one robot; `None` where sensors read the truth.
    pub fn of(
        config: &SensorsConfig,
        seed: u64,
        robot: usize,
        counts: SensorCounts,
        control_period_s: f64,
    ) -> Option<Self> {
        let deviations = [
            config.force_noise_n,
            config.moment_noise_nm,
            config.encoder_noise_rad,
            config.gyro_noise_rad_s,
            config.accelerometer_noise_m_s2,
        ];
        deviations.iter().any(|&deviation| deviation > 0.0).then(|| Self {
            config: config.clone(),
            control_period_s,
            draws: Draws::new(seed, Purpose::SensorNoise, robot),
            counts,
        })
    }

    /// Adds the noise of `tick`. An encoder's rate is the difference quotient of its angle, and so is
    /// the noise of the rate.
    pub fn add(&self, tick: u64, sensors: &mut Sensors) {
        let mut draws = self.at(tick);
        // At tick 0 the encoders have read the same for ever.
        let mut previous = self.at(tick.saturating_sub(1));
        let config = &self.config;
        let angles = sensors.joint_position_rad.iter_mut().zip(&mut sensors.joint_velocity_rad_s);
        for (position, velocity) in angles.take(self.counts.joints) {
            let (now, before) =
                (config.encoder_noise_rad * draws.normal(), config.encoder_noise_rad * previous.normal());
            *position += now;
            *velocity += (now - before) / self.control_period_s;
        }
        let wrists = sensors.wrist_wrench.iter_mut().take(self.counts.hands);
        let ankles = sensors.ankle_wrench.iter_mut().take(self.counts.feet);
        for wrench in wrists.chain(ankles) {
            for (index, component) in wrench.iter_mut().enumerate() {
                let deviation = if index < 3 { config.force_noise_n } else { config.moment_noise_nm };
                *component += deviation * draws.normal();
            }
        }
        for rate in &mut sensors.imu_angular_velocity_rad_s {
            *rate += config.gyro_noise_rad_s * draws.normal();
        }
        for force in &mut sensors.imu_specific_force_m_s2 {
            *force += config.accelerometer_noise_m_s2 * draws.normal();
        }
    }

    /// The draws of a tick: each tick has places of its own, so that nothing needs to be remembered.
    fn at(&self, tick: u64) -> Draws {
        let channels = self.counts.joints + 6 * (self.counts.hands + self.counts.feet) + 6;
        self.draws.at_place(tick.wrapping_mul(channels as u64 * PLACES_OF_NORMAL))
    }
}
