//! `mikoshi plan`: what a scenario comes to, before anything runs.

use crate::arguments::PlanArguments;
use crate::burden::{RobotBurden, burdens};
use crate::failure::{Failure, as_lines};
use crate::fraction::Fraction;
use crate::gain::GainReport;
use crate::prepare::{Prepared, prepare};
use crate::print::{print_error, print_json, print_out};
use crate::pull::{Pull, pulls};
use crate::table;
use crate::way::WayReport;
use core::fmt::Write as _;
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::{Job, Motion, Scenario, Thresholds};
use mikoshi_cooperation::Control;
use mikoshi_ipc_types::{MAX_HANDS, MAX_JOINTS, MAX_ROBOTS};
use mikoshi_runtime::{Input, required_bytes};
use serde::Serialize;
use std::path::Path;

/// Prints the plan.
///
/// # Errors
/// The scenario can't be run.
pub fn plan(arguments: &PlanArguments) -> Result<(), Failure> {
    let prepared = prepare(&arguments.scenario)?;
    let plan = Plan::of(&prepared, arguments.way.as_deref())?;
    if arguments.json {
        print_json(&plan)?;
    } else {
        print_out(&plan.to_text(&prepared));
    }
    let burdens = plan.burdens.iter().filter_map(RobotBurden::warning);
    for warning in plan.gains.warning().into_iter().chain(burdens) {
        print_error(&as_lines("warning", &warning));
    }
    Ok(())
}

/// What `mikoshi plan --json` prints.
#[derive(Debug, Serialize)]
struct Plan<'a> {
    scenario: &'a str,
    description: &'a str,
    seed: u64,
    ticks: u64,
    control_period_s: f64,
    sim_time_s: f64,
    hybrid_start_s: Option<f64>,
    job: Option<&'a Job>,
    arms: Vec<Arm<'a>>,
    rows: Vec<Row<'a>>,
    matrices: Matrices,
    gains: GainReport,
    /// What a way that was measured asks for.
    way: Option<WayReport>,
    pulls: Vec<Pull>,
    burdens: Vec<RobotBurden>,
    schedule: Vec<Phase>,
    shared_memory_bytes: u64,
    thresholds: &'a Thresholds,
}

/// One grasping arm.
#[derive(Debug, Serialize)]
struct Arm<'a> {
    robot: &'a str,
    model: &'a str,
    hand: &'a str,
    /// The palm in the object, `[x, y, z, qw, qx, qy, qz]`.
    hand_in_object: [f64; 7],
}

/// One row of the generalized vectors, and what is controlled along its axes.
#[derive(Debug, Serialize)]
struct Row<'a> {
    name: &'a str,
    /// `force` or `position`, for x, y, z, roll, pitch and yaw.
    control: [&'static str; 6],
}

/// Scalar matrices, row by row: each stands for its Kronecker product with I₆.
#[derive(Debug, Serialize)]
struct Matrices {
    c: Vec<Vec<f64>>,
    w_inverse: Vec<f64>,
    v: Vec<Vec<f64>>,
    u: Vec<Vec<f64>>,
}

/// One call of one service in a tick.
#[derive(Debug, Serialize)]
struct Phase {
    service: String,
    call: String,
    core: Option<usize>,
    budget_s: f64,
    waits_for: Vec<String>,
    publishes: Vec<String>,
}

impl<'a> Plan<'a> {
    fn of(prepared: &'a Prepared, way: Option<&Path>) -> Result<Self, Failure> {
        let (run, scenario) = (&prepared.run, &prepared.run.scenario);
        let gains = GainReport::of(prepared);
        let way = way.map(|file| WayReport::of(file, prepared, &gains)).transpose()?;
        let internal_forces = prepared.law.internal_forces();
        Ok(Self {
            scenario: &scenario.name,
            description: &scenario.description,
            seed: scenario.seed,
            ticks: run.ticks,
            control_period_s: scenario.control_period_s,
            sim_time_s: run.ticks as f64 * scenario.control_period_s,
            hybrid_start_s: scenario.hybrid.start_s,
            job: scenario.job.as_ref(),
            arms: arms(prepared),
            rows: rows(prepared),
            matrices: Matrices {
                c: by_row(&internal_forces.c()),
                w_inverse: internal_forces.w_inverse().to_vec(),
                v: by_row(&internal_forces.v()),
                u: by_row(&internal_forces.u()),
            },
            gains,
            way,
            pulls: pulls(run)?,
            burdens: burdens(run)?,
            schedule: schedule(prepared),
            shared_memory_bytes: required_bytes(&prepared.schedule),
            thresholds: &scenario.thresholds,
        })
    }

    fn to_text(&self, prepared: &Prepared) -> String {
        let mut text = String::new();
        let title = |text: &mut String, title: &str| {
            // Writing to a string can't fail.
            let _ = writeln!(text, "\n{title}");
        };
        let _ = writeln!(text, "{}: {}", self.scenario, self.description);
        let start = match (self.hybrid_start_s, self.job) {
            (Some(start_s), _) => format!("at {start_s} s"),
            (None, Some(_)) => "when the hands hold".to_owned(),
            (None, None) => "never".to_owned(),
        };
        let _ = writeln!(
            text,
            "{} ticks of {} ms, {} s; seed {}; hybrid control starts {start}",
            self.ticks,
            1e3 * self.control_period_s,
            self.sim_time_s,
            self.seed
        );

        if let Some(job) = self.job {
            title(&mut text, "Job");
            text += &job_text(job, &prepared.run);
        }
        title(&mut text, "Arms, in hand order; palms in the object");
        text += &arms_table(&self.arms);

        title(&mut text, "Rows, and what is controlled along their axes");
        let axes = ["row", "x", "y", "z", "roll", "pitch", "yaw"];
        let cells = |row: &Row<'_>| {
            core::iter::once(row.name.to_owned()).chain(row.control.map(str::to_owned)).collect()
        };
        text += &table::of_text(&axes, self.rows.iter().map(cells));

        let arm_names: Vec<_> = self.arms.iter().map(|arm| format!("{}.{}", arm.robot, arm.hand)).collect();
        let row_names: Vec<_> = self.rows.iter().map(|row| row.name.to_owned()).collect();
        title(&mut text, "C: internal forces from the tips' wrenches (each number times I6)");
        text += &matrix_table(&row_names[1..], &arm_names, &self.matrices.c);
        title(
            &mut text,
            "U = [W⁻ V] = [W; C]⁻¹: the tips' wrenches from external and internal forces; W⁻ is its first column",
        );
        text += &matrix_table(&arm_names, &row_names, &self.matrices.u);

        title(&mut text, "Loop gain");
        text += &self.gains_text();
        if let Some(way) = &self.way {
            title(&mut text, "What the way that was measured asks for");
            text += &way.to_text();
        }
        title(
            &mut text,
            "Standing robots pulled by a leader of their kind (eq. 42): until the ZMP is at their toes",
        );
        text += &pulls_table(&self.pulls);
        title(&mut text, "What robots bear: at rest, in the posture in which they begin");
        text += &burdens_table(&self.burdens);
        title(&mut text, "Schedule of a tick");
        text += &prepared.schedule.to_string();
        title(&mut text, "Limits");
        text += &limits_text(&prepared.run.scenario, self.shared_memory_bytes);
        text
    }

    fn gains_text(&self) -> String {
        let gains = &self.gains;
        format!(
            "{:.3} by kh = {:.3e} m/N and {:.3e} rad/Nm: {:.0} % of the critical {:.3}, at which the loop is \
             unstable;\nrecommended are at most {:.0} % ({} ticks of delay, {} Hz filter, {} N/m and {} Nm/rad \
             a hand)\n",
            gains.gain,
            gains.kh_m_n,
            gains.kh_rad_nm,
            100.0 * gains.share(),
            gains.critical,
            100.0 * gains.recommended_share,
            gains.delay_ticks,
            gains.filter_hz,
            gains.stiffness_n_m,
            gains.stiffness_nm_rad
        )
    }
}

/// What the team does, one thing after the other, and when at the earliest.
fn job_text(job: &Job, run: &RunSpec) -> String {
    let carry_s = run.scenario.motion.as_ref().map_or(0.0, Motion::end_s);
    let (lift_mm, back_mm) = (1e3 * job.lift_m, 1e3 * job.draw_back_m);
    let creep_s = job.creep_m / job.creep_m_s;
    let mut start_s = job.start_s;
    let mut steps = String::new();
    for (name, takes_s, what) in [
        ("approach", job.approach_s, format!("open hands go {back_mm:.0} mm along their palms")),
        ("grasp", job.grasp_s, "hands close".to_owned()),
        ("lift", job.settle_s + job.lift_s, format!("what strains the object goes; then {lift_mm:.0} mm up")),
        ("carry", carry_s, "by the motion".to_owned()),
        ("lower", job.lift_s + creep_s + job.unload_s, "down until the support bears it".to_owned()),
        ("release", job.approach_s, "hands open and draw back".to_owned()),
    ] {
        // Writing to a string can't fail.
        let _ = writeln!(steps, "{name:<9} from {start_s:5.1} s on, {takes_s:4.1} s: {what}");
        start_s += takes_s;
    }
    steps
}

fn arms(prepared: &Prepared) -> Vec<Arm<'_>> {
    prepared
        .run
        .robots
        .iter()
        .flat_map(|robot| {
            robot.grasping_hands.iter().zip(&robot.hand_in_object).map(|(&hand, pose)| Arm {
                robot: &robot.member.name,
                model: &robot.config.name,
                hand: &robot.config.hands[hand].name,
                hand_in_object: *pose,
            })
        })
        .collect()
}

fn rows(prepared: &Prepared) -> Vec<Row<'_>> {
    let selection = prepared.law.parameters().selection.rows();
    let name_of = |control: Control| match control {
        Control::Force => "force",
        Control::Position => "position",
    };
    let names = prepared.law.internal_forces().names().iter();
    names.zip(selection).map(|(name, axes)| Row { name, control: axes.map(name_of) }).collect()
}

fn by_row(matrix: &nalgebra::DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn schedule(prepared: &Prepared) -> Vec<Phase> {
    let period_s = prepared.run.scenario.control_period_s;
    let input = |input: &Input| match input.age_ticks {
        0 => input.topic.to_string(),
        age => format!("{}@k-{age}", input.topic),
    };
    let phases = prepared.schedule.phases().iter();
    phases
        .map(|phase| Phase {
            service: phase.service.to_string(),
            call: phase.call.to_string(),
            core: phase.core,
            budget_s: phase.budget * period_s,
            waits_for: phase.inputs.iter().map(input).collect(),
            publishes: phase.outputs.iter().map(|output| output.topic.to_string()).collect(),
        })
        .collect()
}

fn arms_table(arms: &[Arm<'_>]) -> String {
    let cells = |(index, arm): (usize, &Arm<'_>)| {
        let [x, y, z, ..] = arm.hand_in_object;
        let name = format!("{} {}.{}", index + 1, arm.robot, arm.hand);
        vec![name, arm.model.to_owned(), format!("{x:.3}"), format!("{y:.3}"), format!("{z:.3}")]
    };
    table::of_numbers(&["arm", "model", "x [m]", "y [m]", "z [m]"], arms.iter().enumerate().map(cells))
}

fn pulls_table(pulls: &[Pull]) -> String {
    let cells = |pull: &Pull| {
        vec![
            pull.robot.clone(),
            format!("{:.0}", pull.stiffness_n_m),
            format!("{:.3}", pull.zmp_way_m),
            format!("{:.3}", pull.hand_height_m),
            format!("{:.3}", pull.displacement_m),
            pull.time_s.map_or("never moves".to_owned(), |time_s| format!("{time_s:.2}")),
        ]
    };
    let titles = ["robot", "k [N/m]", "Pmax [m]", "Za [m]", "x [m]", "t [s]"];
    table::of_numbers(&titles, pulls.iter().map(cells))
}

fn burdens_table(burdens: &[RobotBurden]) -> String {
    let cells = |burden: &RobotBurden| {
        vec![
            burden.robot.clone(),
            format!("{:.1}", burden.force_n),
            format!("{:.0} % ({})", 100.0 * burden.torque_share, burden.joint),
            format!("{:.0}", burden.bearable_n),
        ]
    };
    table::of_numbers(&["robot", "load N", "torque", "can bear N"], burdens.iter().map(cells))
}

fn matrix_table(rows: &[String], columns: &[String], matrix: &[Vec<f64>]) -> String {
    let titles: Vec<&str> = core::iter::once("").chain(columns.iter().map(String::as_str)).collect();
    let cells = |(name, row): (&String, &Vec<f64>)| {
        let values = row.iter().map(|value| Fraction(*value).to_string());
        core::iter::once(name.clone()).chain(values).collect()
    };
    table::of_numbers(&titles, rows.iter().zip(matrix).map(cells))
}

fn limits_text(scenario: &Scenario, shared_memory_bytes: u64) -> String {
    let mut text = format!(
        "at most {MAX_ROBOTS} robots, {MAX_HANDS} hands and {MAX_JOINTS} joints each; \
         {:.1} MiB of shared memory\n",
        shared_memory_bytes as f64 / f64::from(1 << 20)
    );
    match toml::to_string(&scenario.thresholds) {
        Ok(thresholds) if !thresholds.is_empty() => {
            text += "the run succeeds within\n";
            for line in thresholds.lines() {
                let _ = writeln!(text, "  {line}");
            }
        }
        _ => text += "the run succeeds if no robot falls and nothing touches unintendedly\n",
    }
    text
}
