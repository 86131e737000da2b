//! Figures as SVG text without external fonts or libraries. Sizes are in pixels.
//!
//! [`chart`] draws series, [`heat_map`] tables, [`frame_map`] fields on the frame, [`loops`] fretting loops, [`history`] a run.

pub mod axis;
mod bar;
mod cell_shapes;
pub mod chart;
pub mod colour;
mod fibres;
pub mod frame_map;
pub mod heat_map;
pub mod history;
pub mod loops;

use std::fmt::Write as _;

use crate::output::vtu::escaped;

/// Width and height of a panel.
pub(crate) const PANEL: [f64; 2] = [560.0, 400.0];
const NOTE_HEIGHT_PX: f64 = 26.0;

#[derive(Debug, Default, Clone)]
pub(crate) struct Canvas(String);

#[derive(Debug, Clone, Copy)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Canvas {
    pub(crate) fn add(&mut self, element: std::fmt::Arguments<'_>) {
        self.0.write_fmt(element).expect("writing to a string does not fail");
        self.0.push('\n');
    }

    pub(crate) fn text(&mut self, at: [f64; 2], anchor: Anchor, size: f64, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let [x, y] = at;
        let text = with_powers(&escaped(text));
        self.add(format_args!(
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" font-size="{size}">{text}</text>"#
        ));
    }

    pub(crate) fn upward_text(&mut self, at: [f64; 2], size: f64, text: &str) {
        let [x, y] = at;
        self.add(format_args!(r#"<g transform="translate({x:.1} {y:.1}) rotate(-90)">"#));
        self.text([0.0, 0.0], Anchor::Middle, size, text);
        self.add(format_args!("</g>"));
    }

    pub(crate) fn place(&mut self, offset: [f64; 2], other: &Self) {
        self.add(format_args!(r#"<g transform="translate({:.1} {:.1})">"#, offset[0], offset[1]));
        self.0 += &other.0;
        self.add(format_args!("</g>"));
    }

    /// Completes the picture with a white background.
    pub(crate) fn into_svg(self, size: [f64; 2]) -> String {
        let [width, height] = size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} \
             {height}\" font-family=\"Helvetica, Arial, sans-serif\" fill=\"#222\">\n<rect width=\"{width}\" \
             height=\"{height}\" fill=\"white\"/>\n{}</svg>\n",
            self.0
        )
    }
}

fn with_powers(text: &str) -> String {
    let mut pieces = text.split("^{");
    let mut shown = pieces.next().unwrap_or("").to_owned();
    for piece in pieces {
        let (power, rest) = piece.split_once('}').unwrap_or((piece, ""));
        shown += &format!(
            "<tspan dy=\"-0.4em\" font-size=\"75%\">{power}</tspan><tspan dy=\"0.3em\">&#8203;{rest}</tspan>"
        );
    }
    shown
}

/// Arranges panels in rows of at most `columns`, as one picture.
pub(crate) fn arrange_panels(panels: &[Canvas], size: [f64; 2], columns: usize) -> String {
    arrange_panels_with_note(panels, size, columns, "")
}

/// Arranges panels as [`arrange_panels`] does, and writes the text `note` below the panels, unless it is empty.
pub(crate) fn arrange_panels_with_note(
    panels: &[Canvas],
    size: [f64; 2],
    columns: usize,
    note: &str,
) -> String {
    let columns = columns.min(panels.len()).max(1);
    let rows = panels.len().div_ceil(columns);
    let mut all = Canvas::default();
    for (i, panel) in panels.iter().enumerate() {
        all.place([(i % columns) as f64 * size[0], (i / columns) as f64 * size[1]], panel);
    }
    let [width, mut height] = [columns as f64 * size[0], rows as f64 * size[1]];
    if !note.is_empty() {
        all.text([width / 2.0, height + 16.0], Anchor::Middle, 13.0, note);
        height += NOTE_HEIGHT_PX;
    }
    all.into_svg([width, height])
}
