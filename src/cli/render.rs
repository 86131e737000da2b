//! Mistakes of a scene as a person reads them: file, line, excerpt, what was found, the mend.

use std::fmt;
use std::io::IsTerminal;

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};

use crate::scene::mistake::Place;
use crate::scene::{Mistake, Mistakes};

/// Most mistakes shown at once.
const MOST: usize = 40;

/// All mistakes with excerpts, and their number at the end.
pub fn render(mistakes: &Mistakes) -> String {
    let terminal = std::io::stderr().is_terminal();
    // A wide page keeps messages on one line where a program reads them.
    let (theme, width) =
        if terminal { (GraphicalTheme::default(), 110) } else { (GraphicalTheme::none(), 1000) };
    let handler = GraphicalReportHandler::new_themed(theme).with_width(width).with_context_lines(1);
    let source = NamedSource::new(&mistakes.file, mistakes.text.replace('\r', " "));
    let mut text = String::new();
    for mistake in mistakes.list.iter().take(MOST) {
        let shown = Shown { mistake, source: &source };
        if handler.render_report(&mut text, &shown).is_err() {
            text.push_str(&mistake.message);
        }
        text.push('\n');
    }
    for note in &mistakes.notes {
        text.push_str(&super::remark(note));
        text.push_str("\n\n");
    }
    let n = mistakes.list.len();
    let more = if n > MOST { format!(" ({} not shown)", n - MOST) } else { String::new() };
    let plural = if n == 1 { "mistake" } else { "mistakes" };
    text.push_str(&format!("{n} {plural} in {}{more}; nothing was computed.\n", mistakes.file));
    text
}

/// A mistake as a diagnostic.
#[derive(Debug)]
struct Shown<'a> {
    mistake: &'a Mistake,
    source: &'a NamedSource<String>,
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.mistake.place {
            Place::Option(option) => write!(f, "--set {option}: ")?,
            Place::Scene => write!(f, "{}: ", self.source.name())?,
            Place::File(_) => {}
        }
        if !self.mistake.key.is_empty() {
            write!(f, "{}: ", self.mistake.key)?;
        }
        f.write_str(&self.mistake.message)
    }
}

impl std::error::Error for Shown<'_> {}

impl Diagnostic for Shown<'_> {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        (!self.mistake.mend.is_empty()).then(|| Box::new(&self.mistake.mend) as Box<dyn fmt::Display>)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let Place::File(range) = &self.mistake.place else { return None };
        let length = range.end.saturating_sub(range.start);
        let label = LabeledSpan::new(Some(self.mistake.label.clone()), range.start, length);
        Some(Box::new(std::iter::once(label)))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        matches!(self.mistake.place, Place::File(_)).then_some(self.source as &dyn SourceCode)
    }
}
