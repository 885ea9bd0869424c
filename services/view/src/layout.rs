//! How the parts of the viewer are laid out at first.
//!
//! Rerun's own builder of layouts has no way to say where the eye is, nor how much of the past plots show: what it
//! would write is written here.

use crate::stage::{self, TIME};
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::Clock;
use re_log_types::BlueprintActivationCommand;
use re_sdk::log::LogMsg;
use re_sdk::{AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamError};
use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, PanelBlueprint, TimePanelBlueprint, ViewBlueprint,
    ViewContents, ViewportBlueprint, VisibleTimeRanges,
};
use re_sdk_types::blueprint::components::{
    AutoLayout, AutoViews, BackgroundKind, ColumnShare, ContainerKind, IncludedContent, PanelState,
    PlayState, QueryExpression, RootContainer, RowShare, TimelineName, ViewClass, VisibleTimeRange,
};
use re_sdk_types::components::Name;
use re_sdk_types::datatypes::{self, TimeInt, TimeRange, TimeRangeBoundary};
use re_sdk_types::external::uuid::Uuid;

/// Where the eye is, seen from the object at first: it sees every robot's front or back, and none behind another.
const EYE_M: [f64; 3] = [1.95, -2.6, 1.3];
/// Where it looks at.
const TARGET_M: [f64; 3] = [0.05, 0.05, -0.3];
/// Of no colour, so that robots have theirs.
const BACKGROUND: [u8; 3] = [30, 32, 36];
/// How much of a run that goes on its plots show.
const PAST_S: i64 = 20;

/// The layout of a run.
pub struct Layout {
    eye_m: [f64; 3],
    target_m: [f64; 3],
    is_live: bool,
    plots: Vec<(&'static str, &'static str)>,
}

impl Layout {
    /// Of this run, which goes on or was recorded.
    pub fn of(run: &RunSpec, is_live: bool) -> Self {
        let object_m = run.scenario.object.position_m;
        // Larger teams are seen from further off.
        let reach = |robot: &mikoshi_config::RobotSpec| {
            (robot.member.x_m - object_m[0]).hypot(robot.member.y_m - object_m[1])
        };
        let scale = run.robots.iter().map(reach).fold(0.8, f64::max) / 0.8;
        let seen_from_object =
            |at: [f64; 3], scale: f64| core::array::from_fn(|i| object_m[i] + scale * at[i]);
        let mut plots = vec![
            ("internal forces, N", stage::plots::INTERNAL_FORCES),
            ("error of the object", stage::plots::TRACKING),
            ("margins of zero moment points, mm", stage::plots::MARGINS),
        ];
        plots.extend(is_live.then_some(("longest times, ms", stage::plots::TIMES)));
        let is_by_the_clock = run.scenario.clock == Clock::Wall;
        plots.extend(is_by_the_clock.then_some(("oldest inputs, ticks", stage::plots::AGES)));
        Self {
            eye_m: seen_from_object(EYE_M, scale),
            target_m: seen_from_object(TARGET_M, 1.0),
            is_live,
            plots,
        }
    }

    /// Sends it ahead of what is to be seen.
    ///
    /// # Errors
    /// Nobody takes it.
    pub fn send(&self, stream: &RecordingStream) -> Result<(), RecordingStreamError> {
        let (layout, messages) = RecordingStreamBuilder::new("mikoshi").blueprint().memory()?;
        layout.set_time_sequence("blueprint", 0);
        let mut writer = Writer { layout, ids: 0 };
        writer.write(self)?;
        let messages = messages.take();
        let blueprint_id = messages.iter().find_map(|message| match message {
            LogMsg::SetStoreInfo(info) => Some(info.info.store_id.clone()),
            _ => None,
        });
        if let Some(blueprint_id) = blueprint_id {
            let activation =
                BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
            stream.send_blueprint(messages, activation);
        }
        Ok(())
    }
}

struct Writer {
    layout: RecordingStream,
    ids: u128,
}

impl Writer {
    fn write(&mut self, layout: &Layout) -> Result<(), RecordingStreamError> {
        let scene = self.view("3D", "robots and object", "/world", "/world/**")?;
        let eye = EyeControls3D::new().with_position(layout.eye_m).with_look_target(layout.target_m);
        self.log(&format!("{scene}/EyeControls3D"), &eye.with_eye_up([0.0, 0.0, 1.0]))?;
        self.log(
            &format!("{scene}/Background"),
            &Background::new(BackgroundKind::SolidColor).with_color(BACKGROUND),
        )?;
        let events = self.view("TextLog", "events", "/", "/events")?;
        let left = self.container(ContainerKind::Vertical, &[scene, events], &[6.0, 1.0])?;
        let mut plots = vec![];
        for (name, entity) in &layout.plots {
            let plot = self.view("TimeSeries", name, "/", entity)?;
            if layout.is_live {
                let past = TimeRangeBoundary::CursorRelative(TimeInt(-PAST_S * 1_000_000_000));
                let range = TimeRange { start: past, end: TimeRangeBoundary::CursorRelative(TimeInt(0)) };
                let range = VisibleTimeRange(datatypes::VisibleTimeRange { timeline: TIME.into(), range });
                self.log(&format!("{plot}/VisibleTimeRanges"), &VisibleTimeRanges::new([range]))?;
            }
            plots.push(plot);
        }
        let shares = vec![1.0; plots.len()];
        let right = self.container(ContainerKind::Vertical, &plots, &shares)?;
        let root = self.container(ContainerKind::Horizontal, &[left, right], &[5.0, 3.0])?;
        let root = root.trim_start_matches("container/").parse::<Uuid>().unwrap_or_default();
        let viewport = ViewportBlueprint::new()
            .with_root_container(RootContainer(root.into()))
            .with_auto_layout(AutoLayout(false.into()))
            .with_auto_views(AutoViews(false.into()));
        self.log("viewport", &viewport)?;
        self.log("blueprint_panel", &PanelBlueprint::new().with_state(PanelState::Collapsed))?;
        self.log("selection_panel", &PanelBlueprint::new().with_state(PanelState::Collapsed))?;
        let play = if layout.is_live { PlayState::Following } else { PlayState::Playing };
        let panel = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(TimelineName(TIME.into()))
            .with_play_state(play);
        self.log("time_panel", &panel)
    }

    fn view(
        &mut self,
        class: &str,
        name: &str,
        origin: &str,
        contents: &str,
    ) -> Result<String, RecordingStreamError> {
        let path = format!("view/{}", self.id());
        let contents = ViewContents::new([QueryExpression(contents.into())]);
        self.log(&format!("{path}/ViewContents"), &contents)?;
        let view = ViewBlueprint::new(ViewClass(class.into()))
            .with_display_name(Name(name.into()))
            .with_space_origin(origin);
        self.log(&path, &view)?;
        Ok(path)
    }

    fn container(
        &mut self,
        kind: ContainerKind,
        contents: &[String],
        shares: &[f32],
    ) -> Result<String, RecordingStreamError> {
        let path = format!("container/{}", self.id());
        let mut container = ContainerBlueprint::new(kind)
            .with_contents(contents.iter().map(|content| IncludedContent(content.as_str().into())));
        container = match kind {
            ContainerKind::Horizontal => {
                container.with_col_shares(shares.iter().map(|share| ColumnShare((*share).into())))
            }
            _ => container.with_row_shares(shares.iter().map(|share| RowShare((*share).into()))),
        };
        self.log(&path, &container)?;
        Ok(path)
    }

    fn id(&mut self) -> Uuid {
        self.ids += 1;
        Uuid::from_u128(self.ids)
    }

    fn log(&self, path: &str, what: &dyn AsComponents) -> Result<(), RecordingStreamError> {
        self.layout.log(path, what)
    }
}
