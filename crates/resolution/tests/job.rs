//! The team of a job begins with open hands, drawn back from where they will hold.

#![allow(non_snake_case)]

use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_humanoid::{Kinematics, Model};
use mikoshi_resolution::resolve;
use mikoshi_spatial::{Base, Hand, Object, Pose, World};
use nalgebra::Vector3;
use std::path::Path;

fn pick_and_place(draw_back_m: &str) -> Result<RunSpec, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/pick_and_place.toml");
    let overrides = [("job.draw_back_m".to_owned(), draw_back_m.to_owned())];
    resolve(&load_scenario(&path, &overrides, None).expect("it loads")).map_err(|error| error.to_string())
}

#[test]
fn hands_begin_behind_their_palms_from_where_they_will_hold() {
    let run = pick_and_place("0.05").expect("within reach");
    for robot in &run.robots {
        let model = Model::from_urdf(&robot.urdf, &|_| None).expect("it has no meshes");
        let mut kinematics = Kinematics::new(&model);
        let X_WB = Pose::<World, Base>::from_array(&robot.initial_base_pose).expect("a pose");
        kinematics.update(&model, &X_WB, &robot.initial_posture_rad);
        let X_WA = Pose::<World, Object>::new(run.scenario.object.position_m.into(), Default::default());
        for (&hand, X_AH) in robot.grasping_hands.iter().zip(&robot.hand_in_object) {
            let palm = model.find_frame(&robot.config.hands[hand].palm_link).expect("it is there");
            let X_WH: Pose<World, Hand> = kinematics.frame_pose(&model, palm);
            let place = X_WA * Pose::<Object, Hand>::from_array(X_AH).expect("a pose");
            let gap = place.inverse() * X_WH;
            assert!((gap.translation - Vector3::new(0.0, 0.0, 0.05)).norm() < 2e-4, "{gap:?}");
            assert!(gap.rotation.angle() < 2e-4);
            // Away from the object, and not into it.
            assert!(X_WH.translation.x.abs() > place.translation.x.abs() + 0.02);
        }
    }
}

#[test]
fn hands_that_can_not_be_drawn_back_so_far_are_named() {
    let error = pick_and_place("0.5").expect_err("nobody's arms are so short");
    assert!(error.contains("hand of robot A") && error.contains("misses"), "{error}");
}
