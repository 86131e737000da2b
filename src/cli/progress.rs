//! Progress display: a bar on a terminal, otherwise one line per long stage; no display with `--quiet`.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::console::to_stderr;
use crate::output::recorder::ProgressEvent;

/// Minimum duration of a stage that prints a line if there is no terminal.
const MIN_REPORTED_STAGE: Duration = Duration::from_secs(1);

const MIN_REDRAW_INTERVAL: Duration = Duration::from_millis(60);

const BAR_STEPS: u64 = 1000;

pub(super) struct ProgressDisplay {
    bar: Option<ProgressBar>,
    lines: bool,
    stage: Option<(String, Instant)>,
    /// Largest fraction so far. The bar shows it, so that a restarted solution does not move the bar back.
    done: f64,
    drawn: Instant,
}

impl ProgressDisplay {
    pub fn new(quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = (!quiet && terminal).then(|| {
            let style =
                ProgressStyle::with_template("{prefix:20} {wide_bar} {percent:>3} %  {elapsed} {msg}")
                    .expect("the template is fixed and valid");
            let bar = ProgressBar::new(BAR_STEPS).with_style(style);
            // The tick animates the bar in stages that report no fraction.
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        Self { bar, lines: !quiet, stage: None, done: 0.0, drawn: Instant::now() }
    }

    /// Shows a stage: its name, the completed fraction from 0 to 1, and the natural residual.
    pub fn show(&mut self, name: &str, fraction: f64, residual: Option<f64>) {
        let known = self.stage.as_ref().is_some_and(|(stage, _)| stage == name);
        if !known {
            self.end_stage();
            self.done = 0.0;
            self.stage = Some((name.to_owned(), Instant::now()));
            if let Some(bar) = &self.bar {
                bar.reset();
                bar.set_prefix(name.to_owned());
                bar.set_message("");
            }
        } else if self.drawn.elapsed() < MIN_REDRAW_INTERVAL {
            return;
        }
        self.drawn = Instant::now();
        self.done = self.done.max(fraction.clamp(0.0, 1.0));
        let (Some(bar), Some((_, start))) = (&self.bar, &self.stage) else { return };
        bar.set_position((self.done * BAR_STEPS as f64) as u64);
        let left = remaining(start.elapsed(), self.done).map(|s| format!("{s} left")).unwrap_or_default();
        let residual =
            residual.filter(|r| r.is_finite()).map(|r| format!(" residual {r:.0e}")).unwrap_or_default();
        bar.set_message(format!("{left}{residual}"));
    }

    pub fn on_event(&mut self, event: ProgressEvent) {
        match event {
            ProgressEvent::Stage(name, fraction, residual) => self.show(name, fraction, residual),
            ProgressEvent::Message(text) => self.message(text),
        }
    }

    pub fn message(&mut self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None if self.lines => to_stderr(&format!("{text}\n")),
            None => {}
        }
    }

    fn end_stage(&mut self) {
        let Some((name, start)) = self.stage.take() else { return };
        let line = format!("{name:20} {}", format_duration(start.elapsed().as_secs_f64()));
        if self.bar.is_some() || start.elapsed() >= MIN_REPORTED_STAGE {
            self.message(&line);
        }
    }

    pub fn end(&mut self) {
        self.end_stage();
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

/// Remaining time by linear extrapolation. `None` for fractions up to 0.02.
fn remaining(elapsed: Duration, fraction: f64) -> Option<String> {
    (fraction > 0.02 && fraction <= 1.0)
        .then(|| format_duration(elapsed.as_secs_f64() * (1.0 - fraction) / fraction))
}

pub(super) fn format_duration(s: f64) -> String {
    if s < 10.0 {
        format!("{s:.1} s")
    } else if s < 120.0 {
        format!("{s:.0} s")
    } else if s < 7200.0 {
        format!("{:.0} min", s / 60.0)
    } else {
        format!("{:.1} h", s / 3600.0)
    }
}
