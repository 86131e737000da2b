//! The pictures of a study: families of curves over the cycles, and results over one axis with another as family.

use super::axes::Axis;
use super::collect::Quantity;
use super::file::Sweep;
use super::table::{RunResult, StudyResult};
use crate::results::plot::axis::Scale;
use crate::results::plot::chart::{Chart, Series};
use crate::results::plot::{Canvas, PANEL, arranged};
use crate::results::summary::Status;

/// Most panels of a picture.
const MOST_PANELS: usize = 12;

/// Pictures with the names of their files; runs that did not converge are left out.
pub fn pictures(sweep: &Sweep, result: &StudyResult) -> Vec<(String, String)> {
    let study = Plotted { sweep, result };
    let mut pictures = Vec::new();
    let mut keep = |name: String, panels: Vec<Canvas>| {
        if !panels.is_empty() {
            let shown: Vec<Canvas> = panels.into_iter().take(MOST_PANELS).collect();
            pictures.push((format!("{}.svg", plain(&name)), arranged(&shown, PANEL, 3.min(shown.len()))));
        }
    };
    for quantity in &sweep.curves {
        keep(format!("curves-{}", quantity.path), study.curves(quantity));
    }
    for quantity in &sweep.collect {
        keep(quantity.path.clone(), study.results(quantity));
    }
    pictures
}

/// Letters that every file system takes.
fn plain(name: &str) -> String {
    let fine = |c: &char| c.is_ascii_alphanumeric() || "-_.".contains(*c);
    name.chars().filter(|c| *c != '"').map(|c| if fine(&c) { c } else { '-' }).collect()
}

struct Plotted<'a> {
    sweep: &'a Sweep,
    result: &'a StudyResult,
}

impl Plotted<'_> {
    fn axes(&self) -> &[Axis] {
        &self.sweep.axes
    }

    /// Axes with something to compare; the first one if none has.
    fn varied(&self) -> Vec<usize> {
        let varied: Vec<usize> =
            (0..self.axes().len()).filter(|&i| self.axes()[i].values.len() > 1).collect();
        if varied.is_empty() { vec![0] } else { varied }
    }

    /// The converged run with these values.
    fn run(&self, choice: &[usize]) -> Option<&RunResult> {
        let number = self.sweep.runs.iter().position(|run| run.choice == choice)?;
        self.result.runs.get(number).filter(|run| run.status == Some(Status::Converged))
    }

    /// All combinations of the axes that are not `free`; the free ones stay at their first value.
    fn fixed(&self, free: &[usize]) -> Vec<Vec<usize>> {
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

    /// What a panel has in common: "; angle = 45".
    fn title(&self, quantity: &Quantity, free: &[usize], choice: &[usize]) -> String {
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

    /// Curves over the cycles: for each axis a family of its values, a panel for each combination of the others.
    fn curves(&self, quantity: &Quantity) -> Vec<Canvas> {
        let mut panels = Vec::new();
        for family in self.varied() {
            for choice in self.fixed(&[family]) {
                let series = self.family(Some(family), &choice, |choice| {
                    self.run(choice).map_or(Vec::new(), |run| run.curve(&quantity.path))
                });
                let (x, scale) = match self.sweep.jumping.get(&quantity.step) {
                    Some(&"cycles") => ("cycles".to_owned(), Scale::Linear),
                    Some(other) => (format!("{other}, {}", self.sweep.units.length), Scale::Linear),
                    None => ("increment".to_owned(), Scale::Whole),
                };
                let title = self.title(quantity, &[family], &choice);
                panels.extend(self.chart(quantity, title, (x, scale), series));
            }
        }
        panels
    }

    /// Results over each axis, with each other one as family.
    fn results(&self, quantity: &Quantity) -> Vec<Canvas> {
        let mut panels = Vec::new();
        let varied = self.varied();
        for &over in &varied {
            let mut families: Vec<Option<usize>> =
                varied.iter().copied().filter(|i| *i != over).map(Some).collect();
            if families.is_empty() {
                families.push(None);
            }
            for family in families {
                let free: Vec<usize> = family.into_iter().chain([over]).collect();
                for choice in self.fixed(&free) {
                    let series = self.family(family, &choice, |choice| self.over(over, choice, quantity));
                    let axis = &self.axes()[over];
                    let scale = if axis.is_numeric() { Scale::Linear } else { Scale::Whole };
                    let title = self.title(quantity, &free, &choice);
                    panels.extend(self.chart(quantity, title, (axis_words(axis), scale), series));
                }
            }
        }
        panels
    }

    /// A result over the values of an axis, numbers in rising order, others by their place.
    fn over(&self, over: usize, choice: &[usize], quantity: &Quantity) -> Vec<[f64; 2]> {
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

    /// A series for each value of the family's axis.
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

    fn chart(
        &self,
        quantity: &Quantity,
        title: String,
        (x, scale): (String, Scale),
        series: Vec<Series>,
    ) -> Option<Canvas> {
        if series.iter().all(|series| series.points.is_empty()) {
            return None;
        }
        let labels = [x, quantity.label(&self.sweep.units)];
        Some(Chart { title, labels, scales: [scale, Scale::Linear], series }.panel())
    }
}

/// The name of an axis with its key; with the names of its values where they are no numbers.
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
