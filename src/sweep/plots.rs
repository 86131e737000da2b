//! Plots of a study: curves during a step, results against the values of an axis, heat maps, and scatter plots of samples.

use std::collections::HashMap;

use crate::evolution::step::StepKind;
use crate::output::plot::axis::Scale;
use crate::output::plot::chart::{Chart, Series};
use crate::output::plot::heat_map::HeatMap;
use crate::output::plot::{Canvas, PANEL, arrange_panels_with_note};
use crate::output::summary::Status;
use crate::sweep::axes::Axis;
use crate::sweep::collect::CollectedQuantity;
use crate::sweep::read::Sweep;
use crate::sweep::table::{StudyResult, StudyRun};

const MOST_PANELS: usize = 12;

/// File name and SVG text of each plot. Runs that did not converge are omitted.
pub fn pictures(sweep: &Sweep, result: &StudyResult) -> Vec<(String, String)> {
    let places = sweep.runs.iter().enumerate().map(|(number, run)| (run.choice.as_slice(), number)).collect();
    let study = StudyPlots { sweep, result, places };
    let mut pictures = Vec::new();
    let mut keep = |name: String, panels: Panels| {
        if panels.count > 0 {
            pictures.push((format!("{}.svg", plain(&name)), panels.arrange()));
        }
    };
    for quantity in &sweep.curves {
        keep(format!("curves-{}", quantity.path), study.curves(quantity));
    }
    for quantity in &sweep.collect {
        keep(quantity.path.clone(), study.results(quantity));
        keep(format!("heat-{}", quantity.path), study.heats(quantity));
    }
    pictures
}

/// Panels of a plot. The first [`MOST_PANELS`] panels are drawn, and the others are only counted.
#[derive(Default)]
struct Panels {
    drawn: Vec<Canvas>,
    count: usize,
}

impl Panels {
    fn add(&mut self, draw: impl FnOnce() -> Canvas) {
        if self.drawn.len() < MOST_PANELS {
            self.drawn.push(draw());
        }
        self.count += 1;
    }

    fn arrange(&self) -> String {
        let note = if self.count > self.drawn.len() {
            format!("the first {} of {} panels; all numbers are in study.csv", self.drawn.len(), self.count)
        } else {
            String::new()
        };
        arrange_panels_with_note(&self.drawn, PANEL, 3, &note)
    }
}

/// Removes double quotes, and replaces other characters that file names must not have by hyphens.
fn plain(name: &str) -> String {
    let fine = |c: &char| c.is_ascii_alphanumeric() || "-_.".contains(*c);
    name.chars().filter(|c| *c != '"').map(|c| if fine(&c) { c } else { '-' }).collect()
}

struct StudyPlots<'a> {
    sweep: &'a Sweep,
    result: &'a StudyResult,
    places: HashMap<&'a [usize], usize>,
}

impl StudyPlots<'_> {
    fn axes(&self) -> &[Axis] {
        &self.sweep.axes
    }

    /// Axes with more than one value, or the first axis.
    fn varied(&self) -> Vec<usize> {
        let varied: Vec<usize> =
            (0..self.axes().len()).filter(|&i| self.axes()[i].values.len() > 1).collect();
        if varied.is_empty() { vec![0] } else { varied }
    }

    fn is_side(&self, i: usize) -> bool {
        let axis = &self.axes()[i];
        !axis.is_sample && axis.values.len() > 2
    }

    /// Heat maps of a result. There is a panel for each pair of axes with more than two values and each combination of
    /// values of the other axes. Samples are excluded.
    fn heats(&self, quantity: &CollectedQuantity) -> Panels {
        let sides: Vec<usize> = (0..self.axes().len()).filter(|&i| self.is_side(i)).collect();
        let pairs = sides.iter().enumerate().flat_map(|(k, &x)| sides[k + 1..].iter().map(move |&y| [x, y]));
        let mut panels = Panels::default();
        for [x, y] in pairs {
            for choice in self.combinations_of_other_axes(&[x, y]) {
                let places = [x, y].map(|i| self.in_order(i));
                let cells =
                    places[1].iter().flat_map(|&row| places[0].iter().map(move |&column| (column, row)));
                let number = |(column, row): (usize, usize)| {
                    let mut choice = choice.clone();
                    (choice[x], choice[y]) = (column, row);
                    self.run(&choice)?.result(&quantity.path)
                };
                let values: Vec<Option<f64>> = cells.map(number).collect();
                if values.iter().all(Option::is_none) {
                    continue;
                }
                let words = |i: usize| self.axes()[i].name.clone();
                let names = [0, 1].map(|k| {
                    let axis = &self.axes()[[x, y][k]];
                    places[k].iter().map(|&value| axis.label(value)).collect()
                });
                let labels = [words(x), words(y), quantity.label(&self.sweep.units)];
                let title = self.title(quantity, &[x, y], &choice);
                panels.add(|| HeatMap { title, labels, names, values }.panel());
            }
        }
        panels
    }

    fn in_order(&self, i: usize) -> Vec<usize> {
        let axis = &self.axes()[i];
        let mut order: Vec<usize> = (0..axis.values.len()).collect();
        if axis.is_numeric() {
            order.sort_by(|&a, &b| {
                let number = |value| axis.number(value).unwrap_or(0.0);
                number(a).total_cmp(&number(b))
            });
        }
        order
    }

    /// Results against each key of the sample. In turn, each other varied axis gives the series of the panels.
    fn scattered(&self, sample: usize, quantity: &CollectedQuantity) -> Panels {
        let axis = &self.axes()[sample];
        let others: Vec<usize> = self.varied().into_iter().filter(|&i| i != sample).collect();
        let families: Vec<Option<usize>> =
            if others.is_empty() { vec![None] } else { others.into_iter().map(Some).collect() };
        let mut panels = Panels::default();
        for (k, key) in axis.keys.iter().enumerate() {
            for &family in &families {
                let free: Vec<usize> = family.into_iter().chain([sample]).collect();
                for choice in self.combinations_of_other_axes(&free) {
                    let points = |choice: &[usize]| {
                        let point = |value: usize| {
                            let mut choice = choice.to_vec();
                            choice[sample] = value;
                            Some([axis.value_of_key(value, k)?, self.run(&choice)?.result(&quantity.path)?])
                        };
                        (0..axis.values.len()).filter_map(point).collect()
                    };
                    let series = self.family(family, &choice, points);
                    if series.iter().all(|series| series.points.is_empty()) {
                        continue;
                    }
                    let title = self.title(quantity, &free, &choice);
                    let labels = [key.clone(), quantity.label(&self.sweep.units)];
                    let chart = Chart { title, labels, scales: [Scale::Linear; 2], series };
                    panels.add(|| chart.scattered_panel());
                }
            }
        }
        panels
    }

    fn run(&self, choice: &[usize]) -> Option<&StudyRun> {
        self.result.runs.get(*self.places.get(choice)?).filter(|run| run.status == Some(Status::Converged))
    }

    /// All combinations of values of the axes that are not in `free`. Free axes stay at their first value.
    fn combinations_of_other_axes(&self, free: &[usize]) -> Vec<Vec<usize>> {
        let mut choices = vec![vec![0; self.axes().len()]];
        for (i, axis) in self.axes().iter().enumerate().filter(|(i, _)| !free.contains(i)) {
            let with = |choice: &Vec<usize>| {
                let choice = choice.clone();
                (0..axis.values.len()).map(move |value| {
                    let mut choice = choice.clone();
                    choice[i] = value;
                    choice
                })
            };
            choices = choices.iter().flat_map(with).collect();
        }
        choices
    }

    /// Title of a panel: step, quantity and the fixed values of other axes (", angle = 45").
    fn title(&self, quantity: &CollectedQuantity, free: &[usize], choice: &[usize]) -> String {
        let words = quantity.label(&self.sweep.units);
        let name = words.split(',').next().unwrap_or("");
        let mut title = format!("{}: {name}", quantity.step);
        for (i, axis) in self.axes().iter().enumerate() {
            if !free.contains(&i) && axis.values.len() > 1 {
                title += &format!(", {} = {}", axis.name, axis.label(choice[i]));
            }
        }
        title
    }

    /// Curves of a quantity during a step. In turn, each varied axis gives the curves of a panel. The other axes give
    /// the panels.
    fn curves(&self, quantity: &CollectedQuantity) -> Panels {
        let mut panels = Panels::default();
        if self.axes().iter().any(|axis| axis.is_sample) {
            // A sample would give a curve for each of its points, so that its curves are omitted.
            return panels;
        }
        for family in self.varied() {
            for choice in self.combinations_of_other_axes(&[family]) {
                let series = self.family(Some(family), &choice, |choice| {
                    self.run(choice).map_or(Vec::new(), |run| run.curve(&quantity.path))
                });
                let (x_label, scale) = match self.sweep.step_kinds.get(&quantity.step) {
                    Some(StepKind::Fretting { .. }) => ("cycles".to_owned(), Scale::Linear),
                    Some(StepKind::Sliding { .. }) => {
                        (format!("distance slid, {}", self.sweep.units.length), Scale::Linear)
                    }
                    _ => ("increment".to_owned(), Scale::Whole),
                };
                let title = self.title(quantity, &[family], &choice);
                self.add_chart(&mut panels, quantity, title, x_label, scale, series);
            }
        }
        panels
    }

    /// Results against the values of each varied axis. In turn, each other varied axis gives the series of the panels.
    fn results(&self, quantity: &CollectedQuantity) -> Panels {
        let mut panels = Panels::default();
        let varied = self.varied();
        if let Some(sample) = varied.iter().copied().find(|&i| self.axes()[i].is_sample) {
            return self.scattered(sample, quantity);
        }
        for &over in &varied {
            let mut families: Vec<Option<usize>> =
                varied.iter().copied().filter(|i| *i != over).map(Some).collect();
            if families.is_empty() {
                families.push(None);
            }
            for family in families {
                let free: Vec<usize> = family.into_iter().chain([over]).collect();
                for choice in self.combinations_of_other_axes(&free) {
                    let series = self.family(family, &choice, |choice| self.over(over, choice, quantity));
                    let axis = &self.axes()[over];
                    let scale = if axis.is_numeric() { Scale::Linear } else { Scale::Whole };
                    let title = self.title(quantity, &free, &choice);
                    self.add_chart(&mut panels, quantity, title, axis_words(axis), scale, series);
                }
            }
        }
        panels
    }

    /// Points of a result against the values of an axis, in ascending order. Values that are not numbers are numbered from 1.
    fn over(&self, over: usize, choice: &[usize], quantity: &CollectedQuantity) -> Vec<[f64; 2]> {
        let axis = &self.axes()[over];
        let numeric = axis.is_numeric();
        let point = |value: usize| {
            let mut choice = choice.to_vec();
            choice[over] = value;
            let place = if numeric { axis.number(value)? } else { value as f64 + 1.0 };
            Some([place, self.run(&choice)?.result(&quantity.path)?])
        };
        let mut points: Vec<[f64; 2]> = (0..axis.values.len()).filter_map(point).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    }

    fn family(
        &self,
        family: Option<usize>,
        choice: &[usize],
        points: impl Fn(&[usize]) -> Vec<[f64; 2]>,
    ) -> Vec<Series> {
        let Some(family) = family else {
            return vec![Series { name: String::new(), points: points(choice) }];
        };
        let axis = &self.axes()[family];
        let series = |value: usize| {
            let mut choice = choice.to_vec();
            choice[family] = value;
            Series { name: format!("{} = {}", axis.name, axis.label(value)), points: points(&choice) }
        };
        (0..axis.values.len()).map(series).filter(|series| !series.points.is_empty()).collect()
    }

    fn add_chart(
        &self,
        panels: &mut Panels,
        quantity: &CollectedQuantity,
        title: String,
        x_label: String,
        scale: Scale,
        series: Vec<Series>,
    ) {
        if series.iter().any(|series| !series.points.is_empty()) {
            let labels = [x_label, quantity.label(&self.sweep.units)];
            panels.add(|| Chart { title, labels, scales: [scale, Scale::Linear], series }.panel());
        }
    }
}

/// Label of an axis: name and key. If values are not numbers, the label is the name and the numbered values.
fn axis_words(axis: &Axis) -> String {
    let key = axis.keys.first().filter(|key| **key != axis.name);
    let key = key.map(|key| format!(" ({key})")).unwrap_or_default();
    if axis.is_numeric() {
        return format!("{}{key}", axis.name);
    }
    let names: Vec<String> =
        (0..axis.values.len()).map(|value| format!("{} {}", value + 1, axis.label(value))).collect();
    format!("{}: {}", axis.name, names.join("; "))
}
