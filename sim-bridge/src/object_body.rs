//! The object's models: one for each mass that it has in a run.

use mikoshi_config::RunSpec;
use mikoshi_physics::ObjectBody;
use mujoco_rs::prelude::{MjData, MjModel};

/// One model for each mass that the object has in a run; all but the one in use.
#[derive(Debug, Default)]
pub struct ObjectBodies {
    /// With the tick from which on it counts.
    models: Vec<(u64, Option<Box<MjModel>>)>,
    in_use: usize,
}

impl ObjectBodies {
    /// Of a run whose first model is in use already.
    pub fn new<E>(run: &RunSpec, model: impl Fn(&ObjectBody) -> Result<MjModel, E>) -> Result<Self, E> {
        let later = ObjectBody::all(&run.scenario).into_iter().skip(1);
        let later = later.map(|(tick, body)| Ok((tick, Some(Box::new(model(&body)?)))));
        let models = core::iter::once(Ok((0, None))).chain(later).collect::<Result<_, _>>()?;
        Ok(Self { models, in_use: 0 })
    }

    /// Puts the model of a tick into use; whether it was another one.
    pub fn turn_to(&mut self, tick: u64, data: &mut MjData<Box<MjModel>>) -> bool {
        let place = self.models.iter().rposition(|(from, _)| *from <= tick).unwrap_or(0);
        if place == self.in_use {
            return false;
        }
        let Some(model) = self.models.get_mut(place).and_then(|(_, model)| model.take()) else {
            return false;
        };
        // They differ in numbers only.
        if let (Ok(last), Some((_, slot))) = (data.try_swap_model(model), self.models.get_mut(self.in_use)) {
            *slot = Some(last);
            self.in_use = place;
        }
        true
    }
}
