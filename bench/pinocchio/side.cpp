// What Pinocchio and Eigen make of the same robot: the other side of bench/benches/parts.rs, which loads it as a
// library (bench/src/pinocchio.rs declares the same functions).
//
// As fast as its libraries allow: their headers are compiled for this very machine, the model comes from the archive
// that Pinocchio has made of the URDF, nothing allocates where time is taken, and the inverse kinematics knows what
// ours knows (a joint on the way to the stance foot moves all the rest the opposite way).
//
// Joints arrive and leave in the order of the names that `side_open` was given.

#include <pinocchio/algorithm/center-of-mass.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/serialization.hpp>
#include <pinocchio/spatial.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace pin = pinocchio;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr int BASE_POSITIONS = 7;
constexpr int BASE_VELOCITIES = 6;
constexpr std::size_t HANDS = 2;

// Of `Gains` in pinocchio.rs.
struct Gains {
    double balance_weight, foot_weight, hand_weight, damping, posture_gain;
    double step_m, step_rad;
    double limit_margin, repulsion_zone, repulsion_step;
};

// Of `Frames` in pinocchio.rs. The stance foot is the first.
struct Frames {
    const char *feet[2];
    const char *hands[HANDS];
    const char *waist;
};

struct Targets {
    pin::SE3 feet[2];
    pin::SE3 hands[HANDS];
    Vector3d com;
    Matrix3d waist;
};

struct Case {
    VectorXd position; // of joints only
    Targets targets;
};

// A task's frame against the stance foot: joints on the way from one to the other.
struct Way {
    pin::FrameIndex frame;
    std::vector<int> forwards;  // columns of joints between the frame and the root, but not the stance foot
    std::vector<int> backwards; // the other way round
};

pin::SE3 pose(const double *values) { // x, y, z, qw, qx, qy, qz
    const Eigen::Quaterniond rotation(values[3], values[4], values[5], values[6]);
    return pin::SE3(rotation.toRotationMatrix(), Vector3d(values[0], values[1], values[2]));
}

void write_pose(const pin::SE3 &pose, double *out) { // translation, rotation by columns
    Eigen::Map<Vector3d>{out} = pose.translation();
    Eigen::Map<Matrix3d>{out + 3} = pose.rotation();
}

Vector3d shortened(const Vector3d &vector, double longest) {
    const double norm = vector.norm();
    return norm > longest ? Vector3d(vector * (longest / norm)) : vector;
}

struct Side {
    pin::Model model;
    pin::Data data;
    std::vector<int> column;                // of joint j among the joints' velocities
    std::vector<pin::FrameIndex> links;     // in the order of the names given
    std::array<pin::FrameIndex, 4> extremities; // feet, hands
    Way other_foot, waist;
    std::array<Way, HANDS> hands;
    pin::FrameIndex stance;
    std::vector<int> stance_path;

    std::vector<VectorXd> postures;
    std::vector<Case> cases;
    std::array<pin::Data::Matrix6x, 4> jacobians;

    Gains gains;
    VectorXd preferred, lower, upper;
    VectorXd q; // with the base at the origin
    MatrixXd rows; // tasks, weighted
    VectorXd errors;
    MatrixXd hessian;
    VectorXd increment;
    Eigen::LLT<MatrixXd> factor;
    pin::SE3 base;
    std::array<pin::SE3, HANDS> hand_poses;
    std::array<double, 8> missed;

    explicit Side(const pin::Model &given) : model(given), data(given), factor(given.nv - BASE_VELOCITIES) {}

    int joints() const { return model.nv - BASE_VELOCITIES; }

    pin::FrameIndex link(const char *name) const {
        const auto id = model.getFrameId(name, pin::BODY);
        if (id >= model.frames.size()) throw std::invalid_argument(std::string("no link ") + name);
        return id;
    }

    std::vector<bool> path(pin::FrameIndex frame) const {
        std::vector<bool> on_path(joints());
        for (auto joint = model.frames[frame].parentJoint; joint > 1; joint = model.parents[joint])
            on_path[model.idx_vs[joint] - BASE_VELOCITIES] = true;
        return on_path;
    }

    Way way(pin::FrameIndex frame) const {
        const auto to = path(frame), from = path(stance);
        Way way{frame, {}, {}};
        for (int j = 0; j < joints(); ++j) {
            if (to[j] && !from[j]) way.forwards.push_back(j);
            if (from[j] && !to[j]) way.backwards.push_back(j);
        }
        return way;
    }

    // Rows of a task: the Jacobian of a point at `p` against the stance foot, linear before angular.
    void pose_rows(const Way &way, const Vector3d &p, int first, double linear, double angular) {
        const auto put = [&](int j, double sign) {
            const auto column = data.J.col(BASE_VELOCITIES + j);
            const Vector3d omega = column.tail<3>();
            if (linear > 0.0) {
                rows.col(j).segment<3>(first) = (sign * linear) * (column.head<3>() + omega.cross(p));
                rows.col(j).segment<3>(first + 3) = (sign * angular) * omega;
            } else {
                rows.col(j).segment<3>(first) = (sign * angular) * omega;
            }
        };
        for (const int j : way.forwards) put(j, 1.0);
        for (const int j : way.backwards) put(j, -1.0);
    }

    void pose_errors(const pin::SE3 &now, const pin::SE3 &target, int first, double weight) {
        const Matrix3d turn = target.rotation() * now.rotation().transpose();
        errors.segment<3>(first) = weight * shortened(target.translation() - now.translation(), gains.step_m);
        errors.segment<3>(first + 3) = weight * shortened(pin::log3(turn), gains.step_rad);
    }

    double nearness(double distance) const {
        const double room = gains.limit_margin + gains.repulsion_zone;
        return std::clamp((room - distance) / gains.repulsion_zone, 0.0, 1.0);
    }

    // Eq. 41, damped, as crates/humanoid/src/ik has it where no limit bounds it. All is computed in axes of the base:
    // weights don't depend on axes, and so nothing has to be known of the base's pose before.
    void solve(const Case &task) {
        const int n = joints();
        q.tail(n) = task.position;
        pin::jacobianCenterOfMass(model, data, q, true);
        for (const auto frame : extremities) pin::updateFramePlacement(model, data, frame);
        pin::updateFramePlacement(model, data, waist.frame);

        const pin::SE3 to_base = data.oMf[stance] * task.targets.feet[0].inverse();
        const double balance = std::sqrt(gains.balance_weight), foot = std::sqrt(gains.foot_weight),
                     hand = std::sqrt(gains.hand_weight);
        const Vector3d com = data.com[0];
        for (int j = 0; j < n; ++j) rows.col(j).head<3>() = balance * data.Jcom.col(BASE_VELOCITIES + j);
        for (const int j : stance_path) {
            const auto column = data.J.col(BASE_VELOCITIES + j);
            rows.col(j).head<3>() -= balance * (column.head<3>() + Vector3d(column.tail<3>()).cross(com));
        }
        errors.head<3>() = balance * shortened(to_base.act(task.targets.com) - com, gains.step_m);
        pose_rows(waist, com, 3, 0.0, balance);
        const Matrix3d turn = to_base.rotation() * task.targets.waist * data.oMf[waist.frame].rotation().transpose();
        errors.segment<3>(3) = balance * shortened(pin::log3(turn), gains.step_rad);
        const pin::SE3 &sole = data.oMf[other_foot.frame];
        pose_rows(other_foot, sole.translation(), 6, foot, foot);
        pose_errors(sole, to_base * task.targets.feet[1], 6, foot);
        for (std::size_t h = 0; h < HANDS; ++h) {
            const pin::SE3 &palm = data.oMf[hands[h].frame];
            const int first = 12 + 6 * static_cast<int>(h);
            pose_rows(hands[h], palm.translation(), first, hand, hand);
            pose_errors(palm, to_base * task.targets.hands[h], first, hand);
        }

        const double damping = gains.damping * gains.damping;
        hessian.triangularView<Eigen::Lower>() = rows.transpose().lazyProduct(rows);
        hessian.diagonal().array() += damping;
        increment.noalias() = rows.transpose().lazyProduct(errors);
        for (int j = 0; j < n; ++j) {
            const double at = task.position[j];
            const double below = nearness(at - lower[j]), above = nearness(upper[j] - at);
            const double flee = below * below - above * above;
            increment[j] += damping * (gains.posture_gain * (preferred[j] - at) + gains.repulsion_step * flee);
        }
        factor.compute(hessian);
        factor.solveInPlace(increment);

        // Where that leaves the robot.
        q.tail(n) = task.position + increment;
        pin::centerOfMass(model, data, q, false);
        for (const auto frame : extremities) pin::updateFramePlacement(model, data, frame);
        pin::updateFramePlacement(model, data, waist.frame);
        base = task.targets.feet[0] * data.oMf[stance].inverse();
        missed[0] = (task.targets.com - base.act(data.com[0])).norm();
        const Matrix3d waist_at = base.rotation() * data.oMf[waist.frame].rotation();
        missed[1] = pin::log3(Matrix3d(task.targets.waist * waist_at.transpose())).norm();
        const auto miss = [&](const pin::SE3 &now, const pin::SE3 &target, std::size_t first) {
            missed[first] = (target.translation() - now.translation()).norm();
            missed[first + 1] = pin::log3(Matrix3d(target.rotation() * now.rotation().transpose())).norm();
        };
        miss(base * data.oMf[other_foot.frame], task.targets.feet[1], 2);
        for (std::size_t h = 0; h < HANDS; ++h) {
            hand_poses[h] = base * data.oMf[hands[h].frame];
            miss(hand_poses[h], task.targets.hands[h], 4 + 2 * h);
        }
    }

    void four_jacobians() {
        for (std::size_t i = 0; i < extremities.size(); ++i) {
            jacobians[i].setZero();
            pin::getFrameJacobian(model, data, extremities[i], pin::LOCAL_WORLD_ALIGNED, jacobians[i]);
        }
    }
};

} // namespace

extern "C" {

// The model in this archive; null, and why on standard error, if it can't be used.
Side *side_open(const char *archive, const char *const *joint_names, std::size_t joints,
                const char *const *link_names, std::size_t links, const Frames *frames, const Gains *gains,
                const double *preferred) try {
    pin::Model model;
    pin::serialization::loadFromText(model, archive);
    auto *side = new Side(model);
    if (static_cast<std::size_t>(side->joints()) != joints) throw std::invalid_argument("another number of joints");
    for (std::size_t j = 0; j < joints; ++j) {
        if (!model.existJointName(joint_names[j])) throw std::invalid_argument(std::string("no joint ") + joint_names[j]);
        side->column.push_back(model.idx_vs[model.getJointId(joint_names[j])] - BASE_VELOCITIES);
    }
    for (std::size_t l = 0; l < links; ++l) side->links.push_back(side->link(link_names[l]));
    side->extremities = {side->link(frames->feet[0]), side->link(frames->feet[1]), side->link(frames->hands[0]),
                         side->link(frames->hands[1])};
    side->stance = side->extremities[0];
    const auto path = side->path(side->stance);
    for (int j = 0; j < side->joints(); ++j)
        if (path[j]) side->stance_path.push_back(j);
    side->other_foot = side->way(side->extremities[1]);
    side->waist = side->way(side->link(frames->waist));
    for (std::size_t h = 0; h < HANDS; ++h) side->hands[h] = side->way(side->extremities[2 + h]);

    side->gains = *gains;
    side->preferred.resize(joints);
    for (std::size_t j = 0; j < joints; ++j) side->preferred[side->column[j]] = preferred[j];
    side->lower = model.lowerPositionLimit.tail(joints);
    side->upper = model.upperPositionLimit.tail(joints);
    side->q = pin::neutral(model);
    side->rows = MatrixXd::Zero(12 + 6 * HANDS, joints);
    side->errors = VectorXd::Zero(12 + 6 * HANDS);
    side->hessian = MatrixXd::Zero(joints, joints);
    side->increment = VectorXd::Zero(joints);
    for (auto &jacobian : side->jacobians) jacobian = pin::Data::Matrix6x::Zero(6, model.nv);
    return side;
} catch (const std::exception &error) {
    std::fprintf(stderr, "pinocchio: %s: %s\n", archive, error.what());
    return nullptr;
}

void side_close(Side *side) { delete side; }

void side_add_posture(Side *side, const double *base_pose, const double *position) {
    VectorXd q(side->model.nq);
    q.head<3>() = Vector3d(base_pose[0], base_pose[1], base_pose[2]);
    q.segment<4>(3) << base_pose[4], base_pose[5], base_pose[6], base_pose[3];
    for (std::size_t j = 0; j < side->column.size(); ++j) q[BASE_POSITIONS + side->column[j]] = position[j];
    side->postures.push_back(q);
}

// Targets: both feet, hands, [x, y, z, qw, qx, qy, qz] each; then the centre of mass; then the waist's quaternion.
void side_add_case(Side *side, const double *position, const double *targets) {
    Case task{VectorXd(side->joints()), {}};
    for (std::size_t j = 0; j < side->column.size(); ++j) task.position[side->column[j]] = position[j];
    for (auto &foot : task.targets.feet) foot = pose(targets), targets += 7;
    for (auto &hand : task.targets.hands) hand = pose(targets), targets += 7;
    task.targets.com = Vector3d(targets[0], targets[1], targets[2]);
    task.targets.waist = Eigen::Quaterniond(targets[3], targets[4], targets[5], targets[6]).toRotationMatrix();
    side->cases.push_back(task);
}

// What is timed: `count` times, from posture or case `first` on, round and round.

void side_poses(Side *side, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i)
        pin::centerOfMass(side->model, side->data, side->postures[i % side->postures.size()], true);
}

void side_poses_of_links(Side *side, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i) {
        pin::forwardKinematics(side->model, side->data, side->postures[i % side->postures.size()]);
        pin::updateFramePlacements(side->model, side->data);
    }
}

void side_jacobians(Side *side, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i) {
        pin::jacobianCenterOfMass(side->model, side->data, side->postures[i % side->postures.size()], true);
        for (const auto frame : side->extremities) pin::updateFramePlacement(side->model, side->data, frame);
        side->four_jacobians();
    }
}

void side_solve(Side *side, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i) side->solve(side->cases[i % side->cases.size()]);
}

// What the last of them came to.

void side_com(const Side *side, double *out) { Eigen::Map<Vector3d>{out} = side->data.com[0]; }

void side_link(const Side *side, std::size_t link, double *out) { write_pose(side->data.oMf[side->links[link]], out); }

// Columns as ours are: the base's velocities in world axes, where Pinocchio has them in the base's.
void side_jacobian(const Side *side, std::size_t extremity, double *out) {
    const auto &jacobian = side->jacobians[extremity];
    const Matrix3d to_base = side->data.oMi[1].rotation().transpose();
    Eigen::Map<pin::Data::Matrix6x> ours(out, 6, side->model.nv);
    ours.leftCols<3>() = jacobian.leftCols<3>() * to_base;
    ours.middleCols<3>(3) = jacobian.middleCols<3>(3) * to_base;
    for (std::size_t j = 0; j < side->column.size(); ++j)
        ours.col(BASE_VELOCITIES + j) = jacobian.col(BASE_VELOCITIES + side->column[j]);
}

void side_com_jacobian(const Side *side, double *out) {
    const Matrix3d to_base = side->data.oMi[1].rotation().transpose();
    Eigen::Map<pin::Data::Matrix3x> ours(out, 3, side->model.nv);
    ours.leftCols<3>() = side->data.Jcom.leftCols<3>() * to_base;
    ours.middleCols<3>(3) = side->data.Jcom.middleCols<3>(3) * to_base;
    for (std::size_t j = 0; j < side->column.size(); ++j)
        ours.col(BASE_VELOCITIES + j) = side->data.Jcom.col(BASE_VELOCITIES + side->column[j]);
}

// Joint increments; the base's pose and the hands', as `side_link` writes them; what is missed (centre of mass, waist,
// foot, hands; linear and angular where there are both).
void side_solution(const Side *side, double *increment, double *poses, double *missed) {
    for (std::size_t j = 0; j < side->column.size(); ++j) increment[j] = side->increment[side->column[j]];
    write_pose(side->base, poses);
    for (std::size_t h = 0; h < HANDS; ++h) write_pose(side->hand_poses[h], poses + 12 * (h + 1));
    for (std::size_t i = 0; i < side->missed.size(); ++i) missed[i] = side->missed[i];
}

} // extern "C"
