//! Renders the diagnostics of a scene with file, line, excerpt, cause and remedy.

use std::io::IsTerminal;
use std::ops::Range;

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet, normalize_untrusted_str};

use crate::error::{Severity, Warning};
use crate::scene::document::Location;
use crate::scene::{Diagnostic, Diagnostics};

const MAX_SHOWN: usize = 40;

/// Widths of excerpts in columns: on a terminal, and elsewhere. Longer lines are cut around the marked text.
const EXCERPT_WIDTHS: [usize; 2] = [110, 1000];

/// Text of the first `MAX_SHOWN` diagnostics with excerpts, followed by the notes and the number of all diagnostics.
pub fn render(mistakes: &Diagnostics) -> String {
    let renderer = renderer(std::io::stderr().is_terminal());
    // Carriage returns would be visible in the excerpt. Blanks replace them, and byte positions stay the same.
    let source = mistakes.text.replace('\r', " ");
    let mut text = String::new();
    for mistake in mistakes.list.iter().take(MAX_SHOWN) {
        text.push_str(&renderer.render(&[report(mistake, &mistakes.file, &source)]));
        text.push_str("\n\n");
    }
    for note in &mistakes.notes {
        text.push_str(&with_severity(note));
        text.push_str("\n\n");
    }
    let n = mistakes.list.len();
    let more = if n > MAX_SHOWN { format!(" ({} not shown)", n - MAX_SHOWN) } else { String::new() };
    let plural = if n == 1 { "error" } else { "errors" };
    text.push_str(&format!("{n} {plural} in {}{more}; nothing was computed.\n", mistakes.file));
    text
}

/// Renderer with Unicode lines on a terminal, in colour unless `NO_COLOR` is set. Elsewhere the text is plain.
fn renderer(is_terminal: bool) -> Renderer {
    let [narrow, wide] = EXCERPT_WIDTHS;
    if !is_terminal {
        return Renderer::plain().term_width(wide);
    }
    let is_coloured = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty() || value == "0");
    let renderer = if is_coloured { Renderer::styled() } else { Renderer::plain() };
    renderer.decor_style(DecorStyle::Unicode).term_width(narrow)
}

fn report<'a>(mistake: &'a Diagnostic, file: &'a str, source: &'a str) -> Group<'a> {
    let mut title = match &mistake.location {
        Location::SetOption(option) => format!("--set {option}: "),
        Location::WholeScene => format!("{file}: "),
        Location::File(_) => String::new(),
    };
    if !mistake.key.is_empty() {
        title += &format!("{}: ", mistake.key);
    }
    title += &mistake.message;
    let mut group = Group::with_title(Level::ERROR.primary_title(title));
    if let Location::File(range) = &mistake.location {
        let start = source.floor_char_boundary(range.start);
        let end = source.ceil_char_boundary(range.end).max(start);
        let marked = AnnotationKind::Primary.span(start..end).label(&mistake.label);
        let context = AnnotationKind::Visible.span(with_neighbours(source, start, end));
        group = group.element(Snippet::source(source).path(file).annotation(marked).annotation(context));
    }
    if !mistake.help.is_empty() {
        group = group.element(Level::HELP.message(normalize_untrusted_str(&mistake.help)));
    }
    group
}

/// Extends the byte range `start..end` of `text` into the lines before and after.
fn with_neighbours(text: &str, start: usize, end: usize) -> Range<usize> {
    let before = text[..start].rfind('\n').unwrap_or(start);
    let after = text[end..].find('\n').map_or(end, |newline| (end + newline + 1).min(text.len()));
    before..after
}

/// Text of a warning with its severity. The texts of warnings about uncertain results already contain the severity.
pub(super) fn with_severity(warning: &Warning) -> String {
    let text = &warning.text;
    if warning.severity == Severity::Uncertain { text.clone() } else { format!("note: {text}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::DiagnosticKind;

    fn rendered(text: &str, range: Range<usize>) -> String {
        let mistake = Diagnostic {
            kind: DiagnosticKind::Other,
            key: "a.b".to_owned(),
            message: "found\tsomething".to_owned(),
            label: "beside".to_owned(),
            help: "do this".to_owned(),
            location: Location::File(range),
        };
        render(&Diagnostics {
            file: "scene.toml".to_owned(),
            text: text.to_owned(),
            sha256: String::new(),
            list: vec![mistake],
            notes: Vec::new(),
        })
    }

    /// Truth: lines and characters are counted from 1. The mark is below the marked text, and one line before and after
    /// is shown. A Chinese character is two columns wide, a tab four.
    #[test]
    fn the_marked_text() {
        let text = "zero\none\r\n\té漢 = 3\r\nthree\nfour\n";
        let start = text.find('漢').unwrap();
        let shown = rendered(text, start..start + '漢'.len_utf8());
        let lines: Vec<&str> = shown.lines().map(str::trim_end).collect();
        assert_eq!(
            lines,
            [
                "error: a.b: found    something",
                " --> scene.toml:3:3",
                "  |",
                "2 | one",
                "3 |     é漢 = 3",
                "  |      ^^ beside",
                "4 | three",
                "  |",
                "  = help: do this",
                "",
                "1 error in scene.toml; nothing was computed."
            ]
        );
    }

    /// Truth: a diagnostic is shown at any location. The range may be empty, at the end, on several lines, inside a
    /// character, or beyond the text.
    #[test]
    fn any_place() {
        for text in ["", "\n", "a", "é\r\n\n漢 = [\n1,\n2]\n", "a = 1\r\nb\t= \"é\""] {
            for start in 0..text.len() + 3 {
                for end in start..text.len() + 3 {
                    let shown = rendered(text, start..end);
                    for part in ["a.b: found", "--> scene.toml:", "beside", "help: do this"] {
                        assert!(shown.contains(part), "{text:?}, {start}..{end}: {shown}");
                    }
                }
            }
        }
    }
}
