//! A sheet on the screen.

use super::sheet::{Mood, Sheet};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Text};
use ratatui::widgets::Paragraph;

/// Draws it from this line on, as far as there is room. Returns the last line that it makes sense to begin with.
pub fn draw(frame: &mut Frame<'_>, sheet: &Sheet, from: usize) -> usize {
    let [body, foot] = Layout::vertical([Constraint::Min(0), Constraint::Length(1)]).areas(frame.area());
    let last = sheet.len().saturating_sub(body.height.into());
    let shown = sheet.iter().skip(from.min(last)).take(body.height.into());
    let lines: Vec<_> = shown.map(|(line, mood)| Line::styled(line.as_str(), style_of(*mood))).collect();
    frame.render_widget(Paragraph::new(Text::from(lines)), body);
    let keys = if last > 0 { "q quits, ↑ ↓ scroll" } else { "q quits" };
    frame.render_widget(Paragraph::new(Line::styled(keys, Style::new().add_modifier(Modifier::DIM))), foot);
    last
}

fn style_of(mood: Mood) -> Style {
    match mood {
        Mood::Plain => Style::new(),
        Mood::Title => Style::new().add_modifier(Modifier::BOLD),
        Mood::Warning => Style::new().fg(Color::Yellow),
        Mood::Alarm => Style::new().fg(Color::Red).add_modifier(Modifier::BOLD),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    /// What stands on a screen of this height, and how far it can be scrolled.
    fn screen(height: u16, from: usize) -> (Vec<String>, usize) {
        let sheet: Sheet = (0..10).map(|line| (format!("line {line}"), Mood::Alarm)).collect();
        let mut terminal = Terminal::new(TestBackend::new(20, height)).expect("a screen in memory");
        let mut last = 0;
        terminal.draw(|frame| last = draw(frame, &sheet, from)).expect("a screen in memory");
        let buffer = terminal.backend().buffer().clone();
        let lines = buffer.content.chunks(20).map(|cells| cells.iter().map(|cell| cell.symbol()).collect());
        (lines.map(|line: String| line.trim_end().to_owned()).collect(), last)
    }

    #[test]
    fn what_does_not_fit_can_be_scrolled_to_and_no_further() {
        let (lines, last) = screen(11, 0);
        assert_eq!((lines[0].as_str(), lines[10].as_str(), last), ("line 0", "q quits", 0));
        let (lines, last) = screen(5, 99);
        assert_eq!((lines[0].as_str(), lines[3].as_str(), last), ("line 6", "line 9", 6));
        // No room at all is no harm.
        assert_eq!(screen(1, 0).0.len(), 1);
    }
}
