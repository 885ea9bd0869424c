//! A snapshot as lines of text: what `--once` prints and what the screen shows.

use super::snapshot::{ProcessRow, RobotRow, Snapshot, Team};
use crate::table;

/// A robot that carries with the others.
const MEMBER: &str = mikoshi_ipc_types::member_stage::name(mikoshi_ipc_types::member_stage::MEMBER);

/// Margins below this are as good as none, as in a run's figures.
const EDGE_M: f64 = mikoshi_observation::Figures::EDGE_M;

/// How a line is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mood {
    /// All is well.
    Plain,
    /// Titles of columns.
    Title,
    /// Something to look at.
    Warning,
    /// Something is wrong.
    Alarm,
}

/// Lines, each with its mood.
pub type Sheet = Vec<(String, Mood)>;

/// All that there is to tell; nothing is wider than 80 columns as long as no name is long.
pub fn sheet(snapshot: &Snapshot) -> Sheet {
    let mut lines = head(snapshot);
    lines.push((String::new(), Mood::Plain));
    lines.extend(processes(&snapshot.processes));
    lines.push((String::new(), Mood::Plain));
    lines.extend(robots(&snapshot.robots));
    lines.extend(snapshot.events.iter().map(|event| {
        let mood = if event.what.starts_with("safe stop") { Mood::Alarm } else { Mood::Plain };
        (format!("tick {}: {}", event.tick, event.what), mood)
    }));
    lines
}

/// As plain text.
pub fn to_text(sheet: &Sheet) -> String {
    sheet.iter().flat_map(|(line, _)| [line.as_str(), "\n"]).collect()
}

fn head(snapshot: &Snapshot) -> Sheet {
    let Snapshot { run, scenario, seed, clock, tick, ticks, time_s, rate_hz, real_time_factor, .. } =
        snapshot;
    let unseen = match snapshot.ticks_unseen {
        0 => String::new(),
        unseen => format!(", {unseen} unseen"),
    };
    let first = format!("{scenario} {seed} ({run}, {clock})  tick {tick} of {ticks}, {time_s:.1} s");
    let second = format!("{rate_hz:.0} ticks/s, {real_time_factor:.2} × real time{unseen}");
    let mut lines = vec![(first, Mood::Title)];
    match &snapshot.team {
        None => lines.push((format!("nothing heard yet  {second}"), Mood::Plain)),
        Some(team) => lines.extend(team_lines(team, &second)),
    }
    lines
}

fn team_lines(team: &Team, speed: &str) -> Sheet {
    let (state, mood) = match (team.stop_cause, &team.stop_robot) {
        (None, _) => (format!("{}, speed {:.0} %", team.mode, 100.0 * team.speed_share), Mood::Plain),
        (Some(cause), None) => (format!("{}: {cause}", team.mode), Mood::Alarm),
        (Some(cause), Some(robot)) => (format!("{}: {cause}, robot {robot}", team.mode), Mood::Alarm),
    };
    let largest = |value: f64, unit: &str, row: &Option<String>| match row {
        Some(row) => format!("{value:.1} {unit} ({row})"),
        None => "none".to_owned(),
    };
    let forces = format!(
        "internal {}, {}; object {:.1} mm, {:.1} mrad off",
        largest(team.internal_force_max_n, "N", &team.internal_force_max_row),
        largest(team.internal_moment_max_nm, "Nm", &team.internal_moment_max_row),
        1e3 * team.object_position_error_m,
        1e3 * team.object_attitude_error_rad
    );
    vec![(format!("{state}; {speed}"), mood), (forces, Mood::Plain)]
}

fn processes(rows: &[ProcessRow]) -> Sheet {
    let titles =
        ["process", "pid", "ep", "tick", "Hz", "phase", "work µs", "p99", "wait µs", "p99", "miss", "CPU"];
    let mut moods = vec![Mood::Title];
    let mut cells = vec![];
    for row in rows {
        let status = &row.status;
        let is_well = status.fault.is_none() && (status.alive || status.state == "done");
        let mood = match (is_well, row.missed) {
            (false, _) => Mood::Alarm,
            (true, 0) => Mood::Plain,
            (true, _) => Mood::Warning,
        };
        let name = match &status.robot {
            Some(robot) => format!("{} {robot}", status.service),
            None => status.service.clone(),
        };
        let dash = || "-".to_owned();
        let is_service = !matches!(status.service.as_str(), "supervisor" | "tap");
        let number = |value: String| if is_service { value } else { dash() };
        let mut line = vec![
            name,
            status.pid.map_or_else(dash, |pid| pid.to_string()),
            number(status.epoch.to_string()),
            number(status.tick.to_string()),
            number(format!("{:.0}", row.rate_hz)),
        ];
        let micros = |seconds: f64| format!("{:.0}", 1e6 * seconds);
        let phase_cells = |phase: &super::window::PhaseTimes| {
            let call = phase.call.to_string().chars().take(5).collect();
            let times = [phase.work_p50_s, phase.work_p99_s, phase.wait_p50_s, phase.wait_p99_s];
            [vec![call], times.map(micros).to_vec()].concat()
        };
        let mut phases = row.phases.iter();
        line.extend(phases.next().map_or_else(|| vec![dash(); 5], phase_cells));
        line.push(number(row.missed.to_string()));
        line.push(row.cpu_share.map_or_else(dash, |share| format!("{:.0}%", 100.0 * share)));
        if !is_well {
            let state = status.fault.as_ref().map_or_else(|| "gone".to_owned(), Clone::clone);
            line[0] = format!("{} {state}", line[0]);
        }
        cells.push(line);
        moods.push(mood);
        for phase in phases {
            let blank = |count| vec![String::new(); count];
            cells.push([blank(5), phase_cells(phase), blank(2)].concat());
            moods.push(mood);
        }
    }
    lines_of(&table::dense(&titles, cells), moods)
}

fn robots(rows: &[RobotRow]) -> Sheet {
    let titles = ["robot", "mode", "ZMP mm", "capture mm", "tilt deg", "torque", "at", "steps", "holds"];
    let mut moods = vec![Mood::Title];
    let mut flags = vec![];
    let cells = rows.iter().map(|row| {
        let is_at_edge = row.zmp_margin_m < EDGE_M || row.torque_share >= 1.0;
        moods.push(if is_at_edge || !row.flags.is_empty() { Mood::Warning } else { Mood::Plain });
        if !row.flags.is_empty() {
            flags.push((format!("robot {}: {}", row.name, row.flags.join(", ")), Mood::Warning));
        }
        vec![
            row.name.clone(),
            // Who is on his way out or in says so.
            if row.member == MEMBER { row.mode } else { row.member }.to_owned(),
            format!("{:.1}", 1e3 * row.zmp_margin_m),
            format!("{:.1}", 1e3 * row.capture_point_margin_m),
            format!("{:.2}", row.tilt_rad.to_degrees()),
            format!("{:.0}%", 100.0 * row.torque_share),
            row.torque_joint.clone(),
            row.steps.to_string(),
            format!("{}/{}", row.hands_holding, row.hands),
        ]
    });
    let table = table::dense(&titles, cells.collect::<Vec<_>>());
    let mut lines = lines_of(&table, moods);
    lines.extend(flags);
    lines
}

fn lines_of(text: &str, moods: Vec<Mood>) -> Sheet {
    text.lines().map(str::to_owned).zip(moods).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::status::ProcessStatus;
    use crate::top::snapshot::Happening;
    use crate::top::window::PhaseTimes;
    use mikoshi_runtime::Call;

    fn process(service: &str, robot: Option<&str>, calls: &[Call]) -> ProcessRow {
        let phase = |&call| PhaseTimes {
            call,
            work_p50_s: 120e-6,
            work_p99_s: 1240e-6,
            wait_p50_s: 3200e-6,
            wait_p99_s: 11_300e-6,
        };
        ProcessRow {
            status: ProcessStatus {
                service: service.to_owned(),
                robot: robot.map(str::to_owned),
                pid: Some(1_234_567),
                alive: true,
                epoch: u64::from(!calls.is_empty()),
                tick: 123_456,
                state: "running".to_owned(),
                fault: None,
            },
            rate_hz: 1000.0,
            phases: calls.iter().map(phase).collect(),
            missed: 0,
            cpu_share: Some(0.99),
            swaps: 0,
        }
    }

    fn snapshot(robots: usize) -> Snapshot {
        let names: Vec<_> = (b'A'..).take(robots).map(|name| char::from(name).to_string()).collect();
        let mut processes = vec![
            process("supervisor", None, &[]),
            process("bridge", None, &[Call::Step]),
            process("coordinator", None, &[Call::Coordinate]),
        ];
        processes.extend(names.iter().map(|name| process("servo", Some(name), &[Call::Sense, Call::Act])));
        let robot = |name: &String| RobotRow {
            name: name.clone(),
            mode: "carry",
            member: MEMBER,
            zmp_margin_m: 0.0321,
            capture_point_margin_m: 0.0287,
            tilt_rad: 0.01,
            torque_share: 0.43,
            torque_joint: "LLEG_JOINT3".to_owned(),
            steps: 123,
            hands: 2,
            hands_holding: 2,
            flags: vec![],
        };
        Snapshot {
            run: "1234567-0".to_owned(),
            scenario: "transport".to_owned(),
            seed: 0,
            clock: "lockstep",
            tick: 123_456,
            ticks: 999_999,
            time_s: 617.2,
            rate_hz: 1000.0,
            real_time_factor: 5.0,
            ticks_unseen: 0,
            team: Some(Team {
                mode: "carry",
                stop_cause: None,
                stop_robot: None,
                speed_share: 1.0,
                internal_force_max_n: 12.3,
                internal_force_max_row: Some("AB|CD".to_owned()),
                internal_moment_max_nm: 3.2,
                internal_moment_max_row: Some("A|B".to_owned()),
                object_position_error_m: 0.0012,
                object_attitude_error_rad: 0.0034,
                hands_absent: 0,
            }),
            processes,
            robots: names.iter().map(robot).collect(),
            events: vec![],
        }
    }

    #[test]
    fn four_robots_and_all_their_processes_fit_a_terminal_of_80_columns_and_24_lines() {
        let sheet = sheet(&snapshot(4));
        for (line, _) in &sheet {
            assert!(line.chars().count() <= 80, "{}: {line}", line.chars().count());
        }
        assert!(sheet.len() <= 23, "{}\n{}", sheet.len(), to_text(&sheet));
    }

    #[test]
    fn what_is_wrong_stands_out() {
        let mut snapshot = snapshot(2);
        let mood_of = |snapshot: &Snapshot, text: &str| {
            let sheet = sheet(snapshot);
            let found = sheet.iter().find(|(line, _)| line.contains(text));
            found.unwrap_or_else(|| panic!("no {text:?} in\n{}", to_text(&sheet))).1
        };
        assert_eq!(mood_of(&snapshot, "servo B"), Mood::Plain);
        snapshot.processes[4].missed = 3;
        assert_eq!(mood_of(&snapshot, "servo B"), Mood::Warning);
        (snapshot.processes[4].status.alive, snapshot.processes[4].status.fault) =
            (false, Some("died".to_owned()));
        assert_eq!(mood_of(&snapshot, "servo B died"), Mood::Alarm);
        snapshot.robots[0].flags = vec!["torque-limit"];
        assert_eq!(mood_of(&snapshot, "robot A: torque-limit"), Mood::Warning);
        let team = snapshot.team.as_mut().expect("it was heard of");
        (team.mode, team.stop_cause, team.stop_robot) = ("safe stop", Some("tilt"), Some("B".to_owned()));
        assert_eq!(mood_of(&snapshot, "safe stop: tilt, robot B"), Mood::Alarm);
        snapshot.events = vec![Happening { tick: 7, what: "safe stop: tilt, robot B".to_owned() }];
        assert_eq!(mood_of(&snapshot, "tick 7: safe stop"), Mood::Alarm);
    }
}
