//! What `omnibus top` shows, drawn into a buffer of cells.

use ratatui::{
    buffer::Buffer,
    layout::{Constraint, Layout, Rect},
    style::{Modifier, Style},
    widgets::{Paragraph, Row, Table, Widget, Wrap},
};

/// The contents of the screen.
pub(super) struct View {
    /// Simulator, map, mode, frame and frame rate.
    pub(super) title: String,
    /// Role, name, process, works, frames behind, missed, unread outcomes.
    pub(super) members: Vec<[String; 7]>,
    /// The parts of a frame with percentiles 50, 90, 99 and 100, in milliseconds.
    pub(super) parts: Vec<(String, [f64; 4])>,
    pub(super) queues: String,
    /// The sentence that names the limiting stage.
    pub(super) limit: String,
}

const BOLD: Style = Style::new().add_modifier(Modifier::BOLD);
const HEAD: Style = Style::new().add_modifier(Modifier::UNDERLINED);

impl View {
    /// Lines that all of it needs.
    pub(super) fn height(&self) -> u16 {
        (self.members.len() + self.parts.len()) as u16 + 13
    }

    /// Draws all of it into `area`; what has no room is left out.
    pub(super) fn render(&self, area: Rect, buffer: &mut Buffer) {
        let [title, members, parts, queues, limit, keys] = Layout::vertical([
            Constraint::Length(2),
            Constraint::Length(self.members.len() as u16 + 2),
            Constraint::Length(self.parts.len() as u16 + 2),
            Constraint::Length(2),
            Constraint::Min(4),
            Constraint::Length(1),
        ])
        .areas(area);
        Paragraph::new(self.title.as_str()).style(BOLD).render(title, buffer);
        self.members().render(members, buffer);
        self.parts().render(parts, buffer);
        Paragraph::new(format!("queues: {}", self.queues)).render(queues, buffer);
        Paragraph::new(self.limit.as_str())
            .style(BOLD)
            .wrap(Wrap { trim: true })
            .render(limit, buffer);
        Paragraph::new("* holds the tick; q leaves").render(keys, buffer);
    }

    fn members(&self) -> Table<'_> {
        let head = ["participant", "name", "process", "works", "behind", "missed", "unread"];
        let widths = [14, 26, 9, 7, 8, 8, 8].map(Constraint::Length);
        let rows = self.members.iter().map(|cells| Row::new(cells.iter().map(String::as_str)));
        Table::new(rows, widths).header(Row::new(head).style(HEAD))
    }

    fn parts(&self) -> Table<'_> {
        let head = ["milliseconds", "     p50", "     p90", "     p99", " longest"];
        let widths = [22, 9, 9, 9, 9].map(Constraint::Length);
        let rows = self.parts.iter().map(|(name, percentiles)| {
            let numbers = percentiles.iter().map(|ms| format!("{ms:8.3}"));
            Row::new(std::iter::once(name.clone()).chain(numbers))
        });
        Table::new(rows, widths).header(Row::new(head).style(HEAD))
    }
}

/// Returns the text of a buffer, without trailing blanks and lines.
pub(super) fn text_of(buffer: &Buffer) -> String {
    let width = usize::from(buffer.area.width).max(1);
    let lines = buffer.content.chunks(width).map(|cells| {
        let line: String = cells.iter().map(|cell| cell.symbol()).collect();
        line.trim_end().to_owned()
    });
    lines.collect::<Vec<_>>().join("\n").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::{Terminal, backend::TestBackend};

    #[test]
    fn a_view_has_every_line_and_a_small_terminal_is_no_error() {
        let member = ["traffic", "traffic", "17", "12 %", "0", "3", ""].map(str::to_owned);
        let view = View {
            title: "demo on Town, synchronous, frame 9, 20.0 frames/s".to_owned(),
            members: vec![member],
            parts: vec![("physics".to_owned(), [1.25, 2.5, 3.0, 4.0])],
            queues: "nothing".to_owned(),
            limit: "Rendering limits the frame rate.".to_owned(),
        };
        for (width, height) in [(80, 24), (10, 3), (1, 1)] {
            let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
            terminal.draw(|frame| view.render(frame.area(), frame.buffer_mut())).unwrap();
            let shown = text_of(terminal.backend().buffer());
            if width == 80 {
                for part in ["frame 9", "12 %", "1.250", "queues: nothing", "Rendering", "q leaves"]
                {
                    assert!(shown.contains(part), "no {part:?}:\n{shown}");
                }
            }
        }
    }
}
