//! History plots of a run: resultants over the entries, wear over cycles or distance slid.

use crate::evolution::records::IncrementRecord;
use crate::output::plot::axis::Scale;
use crate::output::plot::chart::{Band, Chart, Series};
use crate::output::plot::loops::four_digits;
use crate::output::plot::{Canvas, PANEL, arrange_panels};
use crate::output::summary::Units;

/// Draws forces and areas over the entries. With cycles or sliding, it also draws wear volume, wear depth and load over
/// the cycles or the sliding distance.
pub fn history_svg(records: &[IncrementRecord], units: &Units) -> String {
    let mut panels = vec![forces(records, units), areas(records, units)];
    for along in [WearAbscissa::Cycles, WearAbscissa::Distance] {
        if records.iter().any(|record| along.of(record) > 0.0) {
            panels.push(wear_volume_panel(records, along, units));
            panels.extend(load_panel(records, along, units));
            panels.push(wear_panel(records, along, "Largest wear depth", |r| r.max_wear_depth, units));
        }
    }
    arrange_panels(&panels, PANEL, 2)
}

#[derive(Clone, Copy, PartialEq)]
enum WearAbscissa {
    Cycles,
    Distance,
}

impl WearAbscissa {
    fn of(self, record: &IncrementRecord) -> f64 {
        match self {
            Self::Cycles => record.cycles_done as f64,
            Self::Distance => record.distance_slid,
        }
    }

    fn label(self, units: &Units) -> String {
        match self {
            Self::Cycles => "cycles".to_owned(),
            Self::Distance => format!("sliding distance, {}", units.length),
        }
    }
}

type Value = fn(&IncrementRecord) -> f64;

fn entry_panel(records: &[IncrementRecord], title: &str, unit: &str, values: &[(&str, Value)]) -> Canvas {
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
    entry_panel(records, "Force on body 1", &units.force, &values)
}

fn areas(records: &[IncrementRecord], units: &Units) -> Canvas {
    let values: [(&str, Value); 2] = [("contact", |r| r.contact_area), ("stick", |r| r.stick_area)];
    entry_panel(records, "Area", &format!("{}^{{2}}", units.length), &values)
}

fn chart(along: WearAbscissa, title: &str, label: &str, series: Vec<Series>, units: &Units) -> Chart {
    Chart {
        title: title.to_owned(),
        labels: [along.label(units), label.to_owned()],
        scales: [Scale::Linear, Scale::Linear],
        series,
    }
}

fn wear_panel(
    records: &[IncrementRecord],
    along: WearAbscissa,
    title: &str,
    value: Value,
    units: &Units,
) -> Canvas {
    let points = records.iter().map(|record| [along.of(record), value(record)]).collect();
    let series = vec![Series { name: title.to_owned(), points }];
    chart(along, title, &format!("{title}, {}", units.length), series, units).panel()
}

/// Wear volume, with a band for its estimated integration error over the jumps.
fn wear_volume_panel(records: &[IncrementRecord], along: WearAbscissa, units: &Units) -> Canvas {
    let points = records.iter().map(|record| [along.of(record), record.worn_volume]).collect();
    let edges = records.iter().map(|record| {
        let (volume, error) = (record.worn_volume, record.worn_volume_error);
        [along.of(record), volume - error, volume + error]
    });
    let band = Band { series: 0, edges: edges.collect() };
    let series = vec![Series { name: "wear volume".to_owned(), points }];
    let last = records.last().map_or(0.0, |record| record.worn_volume_error);
    let title = if last > 0.0 {
        format!(
            "Wear volume (shaded: \u{b1} {} {}^{{3}}, error of the jumps)",
            four_digits(last),
            units.length
        )
    } else {
        "Wear volume".to_owned()
    };
    let label = format!("Wear volume, {}^{{3}}", units.length);
    chart(along, &title, &label, series, units).panel_with_bands(&[band])
}

/// Normal force of the wear jumps. For fretting cycles, the panel also shows the normal forces at both reversal points.
fn load_panel(records: &[IncrementRecord], along: WearAbscissa, units: &Units) -> Option<Canvas> {
    let belongs = |record: &&IncrementRecord| match along {
        WearAbscissa::Cycles => record.stroke_ends.is_some(),
        WearAbscissa::Distance => record.jump.is_some() && record.stroke_ends.is_none(),
    };
    let jumps: Vec<&IncrementRecord> = records.iter().filter(belongs).collect();
    let series = |name: &str, value: fn(&IncrementRecord) -> Option<f64>| Series {
        name: name.to_owned(),
        points: jumps.iter().filter_map(|jump| Some([along.of(jump), value(jump)?])).collect(),
    };
    let all = [
        series("mean", |jump| Some(jump.normal_force)),
        series("+ reversal point", |jump| Some(jump.stroke_ends?[0].normal_force)),
        series("\u{2212} reversal point", |jump| Some(jump.stroke_ends?[1].normal_force)),
    ];
    let shown: Vec<Series> = all.into_iter().filter(|series| !series.points.is_empty()).collect();
    let label = format!("normal force, {}", units.force);
    (!shown.is_empty()).then(|| chart(along, "Load", &label, shown, units).panel())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolution::records::Resultants;

    /// Truth: values of the records, in pixels. The band is the wear volume ± its estimated error. The loads are the mean force and
    /// the forces at both reversal points.
    #[test]
    fn errors_and_loads_are_those_of_the_records() {
        let end = |normal_force: f64| Resultants { normal_force, ..Resultants::default() };
        let entry = |cycles_done: u64, worn_volume: f64| IncrementRecord {
            cycles_done,
            worn_volume,
            worn_volume_error: 0.5 * worn_volume,
            normal_force: 300.0,
            stroke_ends: Some([end(200.0), end(400.0)]),
            ..Default::default()
        };
        let records = [IncrementRecord::default(), entry(20, 4.0), entry(100, 8.0)];
        let units = Units::default();
        let picture = wear_volume_panel(&records, WearAbscissa::Cycles, &units).into_svg(PANEL);
        assert!(picture.contains("\u{b1} 4.000 mm"), "{picture}");
        // 0 to 12 mm³ take 314 pixels upwards from 348, and 0 to 100 cycles take 466 pixels from 76.
        assert!(
            picture.contains("M76.0 348.0L169.2 191.0L542.0 34.0L542.0 243.3L169.2 295.7L76.0 348.0z"),
            "{picture}"
        );
        let loads = load_panel(&records, WearAbscissa::Cycles, &units).unwrap().into_svg(PANEL);
        // 200 to 400 N take 314 pixels: the mean lies half-way, and the reversal points lie at the edges.
        for path in ["M169.2 191.0L542.0 191.0", "M169.2 348.0L542.0 348.0", "M169.2 34.0L542.0 34.0"] {
            assert!(loads.contains(path), "{path}: {loads}");
        }
        assert!(load_panel(&records[..1], WearAbscissa::Cycles, &units).is_none());
    }
}
