//! The screen of whoever drives. Without colours it says the same.

use super::keys::HELP;
use super::view::View;
use super::wish::Wish;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Text};
use ratatui::widgets::Paragraph;

/// Draws it, as far as there is room: what matters most comes first.
pub fn draw(frame: &mut Frame<'_>, view: &View, wish: &Wish) {
    let keys = HELP.len() as u16;
    let [body, foot] = Layout::vertical([Constraint::Min(8), Constraint::Length(keys)]).areas(frame.area());
    frame.render_widget(Paragraph::new(Text::from(lines(view, wish))), body);
    let help: Vec<_> = HELP.into_iter().map(Line::from).collect();
    frame.render_widget(Paragraph::new(Text::from(help)), foot);
}

fn lines(view: &View, wish: &Wish) -> Vec<Line<'static>> {
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let time = view.time_s.map_or_else(|| "nothing seen yet".to_owned(), |time_s| format!("{time_s:.1} s"));
    let (state, mood) = match (&view.stop, view.awaited) {
        (Some(cause), _) => (format!("STOPPED: {cause} (r goes on)"), bold.fg(Color::Red)),
        (None, Some(word)) => (format!("{}, until you say {word}", view.mode), bold),
        (None, None) => (view.mode.to_owned(), bold),
    };
    let rates = |[vx, vy, vz, wx, wy, wz]: [f64; 6]| {
        let [vx, vy, vz, wx, wy, wz] = [vx, vy, vz, wx, wy, wz].map(|rate| 1e3 * rate);
        format!("{vx:6.1} {vy:6.1} {vz:6.1} mm/s {wx:6.1} {wy:6.1} {wz:6.1} mrad/s")
    };
    let [x, y, z] = view.position_m;
    vec![
        Line::styled(format!("drive: {}  {time}", view.title), bold),
        Line::styled(state, mood),
        Line::default(),
        Line::from(format!("wanted   {}  ahead, left, up", rates(wish.twist()))),
        Line::from(format!("object   {}  x, y, z", rates(view.twist_ref))),
        Line::from(format!("at       {x:6.3} {y:6.3} {z:6.3} m, {:.1} mm off", 1e3 * view.error_m)),
        Line::from(format!(
            "speed {} of 10, slowest robot allows {:.0} %; squeeze {:.0} N of {:.0}; internal {:.1} N",
            wish.tenths(),
            100.0 * view.speed_share,
            view.squeeze_n,
            wish.squeeze_n(),
            view.internal_n
        )),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_config::scenario::DriveLimits;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn screen(columns: u16, rows: u16) -> String {
        let stop = Some("operator-stop".to_owned());
        let view = View { title: "drive, seed 0".to_owned(), time_s: Some(12.3), stop, ..View::default() };
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).expect("a screen in memory");
        let wish = Wish::new(DriveLimits::default());
        terminal.draw(|frame| draw(frame, &view, &wish)).expect("a screen in memory");
        let cells = terminal.backend().buffer().content.chunks(columns.into());
        cells.map(|row| row.iter().map(|cell| cell.symbol()).collect::<String>() + "\n").collect()
    }

    #[test]
    fn all_of_it_stands_on_a_small_screen_and_a_smaller_one_is_no_harm() {
        let text = screen(80, 24);
        for part in [
            "drive, seed 0  12.3 s",
            "STOPPED: operator-stop",
            "wanted",
            "squeeze",
            "EMERGENCY STOP",
            "lean left, right",
            "internal 0.0 N",
        ] {
            assert!(text.contains(part), "no {part:?} in\n{text}");
        }
        assert!(screen(30, 4).contains("STOPPED"));
        screen(1, 1);
    }
}
