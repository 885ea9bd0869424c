//! One humanoid robot: model, kinematics, whole-body inverse kinematics, estimation, balance.
