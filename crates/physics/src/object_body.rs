//! What the object weighs, and how that changes when something is put into it or taken out.

use mikoshi_config::scenario::{LoadChange, Object, Scenario};
use nalgebra::{Matrix3, Vector3};

/// Mass, its centre, and inertia about that centre, in the object's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectBody {
    /// Mass.
    pub mass_kg: f64,
    /// Its centre.
    pub com_m: Vector3<f64>,
    /// Inertia about that centre.
    pub inertia_kg_m2: Matrix3<f64>,
}

impl ObjectBody {
    /// A box that is as heavy everywhere, but for where its centre of mass is said to be.
    pub fn of(object: &Object) -> Self {
        let [x, y, z] = object.size_m;
        let of_box = Vector3::new(y * y + z * z, x * x + z * z, x * x + y * y) * (object.mass_kg / 12.0);
        Self {
            mass_kg: object.mass_kg,
            com_m: object.com_m.into(),
            inertia_kg_m2: Matrix3::from_diagonal(&of_box),
        }
    }

    /// The same with a point of mass more, or less.
    pub fn with(&self, change: &LoadChange) -> Self {
        let point = Vector3::from(change.position_m);
        let mass_kg = self.mass_kg + change.mass_kg;
        let com_m = (self.com_m * self.mass_kg + point * change.mass_kg) / mass_kg;
        let moved = |from: Vector3<f64>, mass: f64| {
            let way = from - com_m;
            (Matrix3::identity() * way.norm_squared() - way * way.transpose()) * mass
        };
        let inertia_kg_m2 =
            self.inertia_kg_m2 + moved(self.com_m, self.mass_kg) + moved(point, change.mass_kg);
        Self { mass_kg, com_m, inertia_kg_m2 }
    }

    /// The object of this scenario after each of its changes, in order of time, with the tick of each.
    pub fn all(scenario: &Scenario) -> Vec<(u64, Self)> {
        let mut changes: Vec<_> = scenario.world.load_changes.iter().collect();
        changes.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        let mut bodies = vec![(0, Self::of(&scenario.object))];
        for change in changes {
            let (_, last) = bodies[bodies.len() - 1];
            bodies.push((scenario.tick_at(change.at_s), last.with(change)));
        }
        bodies
    }
}
