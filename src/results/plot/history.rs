//! The course of a run: resultants over the entries of the summary, wear over the cycles.

use super::axis::Scale;
use super::chart::{Chart, Series};
use super::{Canvas, PANEL, arranged};
use crate::history::step::{IncrementRecord, StrokeEnd};
use crate::results::summary::Units;

/// Forces and areas over the entries and, with cycles, worn volume, load and wear depth over them, as one picture.
pub fn history_svg(records: &[IncrementRecord], units: &Units) -> String {
    let mut panels = vec![forces(records, units), areas(records, units)];
    if records.iter().any(|record| record.cycles_done > 0) {
        panels
            .push(over_cycles(records, "Worn volume", &format!("{}^{{3}}", units.length), |r| r.worn_volume));
        panels.extend(load_over_cycles(records, units));
        panels.push(over_cycles(records, "Largest worn depth", &units.length, |r| r.max_wear_depth));
    }
    arranged(&panels, PANEL, 2)
}

type Value = fn(&IncrementRecord) -> f64;

fn over_entries(records: &[IncrementRecord], title: &str, unit: &str, values: &[(&str, Value)]) -> Canvas {
    let points = |value: Value| {
        records.iter().enumerate().map(|(i, record)| [(i + 1) as f64, value(record)]).collect()
    };
    let series = |(name, value): &(&str, Value)| Series { name: (*name).to_owned(), points: points(*value) };
    let chart = Chart {
        title: title.to_owned(),
        labels: ["entry (increment or cycle jump)".to_owned(), format!("{title}, {unit}")],
        scales: [Scale::Whole, Scale::Linear],
        series: values.iter().map(series).collect(),
    };
    chart.panel()
}

fn forces(records: &[IncrementRecord], units: &Units) -> Canvas {
    let values: [(&str, Value); 3] = [
        ("normal", |r| r.normal_force),
        ("tangential x", |r| r.tangential_force[0]),
        ("tangential y", |r| r.tangential_force[1]),
    ];
    over_entries(records, "Force on body 1", &units.force, &values)
}

fn areas(records: &[IncrementRecord], units: &Units) -> Canvas {
    let values: [(&str, Value); 2] = [("contact", |r| r.contact_area), ("stick", |r| r.stick_area)];
    over_entries(records, "Area", &format!("{}^{{2}}", units.length), &values)
}

fn over_cycles(records: &[IncrementRecord], title: &str, unit: &str, value: Value) -> Canvas {
    let chart = Chart {
        title: title.to_owned(),
        labels: ["cycles".to_owned(), format!("{title}, {unit}")],
        scales: [Scale::Linear, Scale::Linear],
        series: vec![Series {
            name: title.to_owned(),
            points: records.iter().map(|record| [record.cycles_done as f64, value(record)]).collect(),
        }],
    };
    chart.panel()
}

/// An entry with the ends of its strokes.
type Jump<'a> = (&'a IncrementRecord, [StrokeEnd; 2]);

/// The load at both ends of the strokes and its mean; `None` where no entry has strokes.
fn load_over_cycles(records: &[IncrementRecord], units: &Units) -> Option<Canvas> {
    let jumps: Vec<Jump> = records.iter().filter_map(|record| Some((record, record.stroke_ends?))).collect();
    let series = |name: &str, value: fn(&Jump) -> f64| Series {
        name: name.to_owned(),
        points: jumps.iter().map(|jump| [jump.0.cycles_done as f64, value(jump)]).collect(),
    };
    let chart = Chart {
        title: "Load".to_owned(),
        labels: ["cycles".to_owned(), format!("normal force, {}", units.force)],
        scales: [Scale::Linear, Scale::Linear],
        series: vec![
            series("mean", |jump| jump.0.normal_force),
            series("+ end of the stroke", |jump| jump.1[0].normal_force),
            series("\u{2212} end", |jump| jump.1[1].normal_force),
        ],
    };
    (!jumps.is_empty()).then(|| chart.panel())
}
