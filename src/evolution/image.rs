//! Runs that are images of another one, mirrored or turned: its entries with their fields, and the image of each.
//!
//! Bodies and laws that are images of each other have answers that are: tractions, gaps and slips as vectors, moments and rotations as
//! axial ones. That they are is not taken for granted: laws and initial gap are compared, and the gap of every entry is evaluated again, by the
//! operator of the model that the image is for.

use std::sync::Arc;
use std::time::Instant;

use nalgebra::{Matrix2, Vector2};

use crate::evolution::RunResult;
use crate::evolution::balance::names_direction;
use crate::evolution::model::Model;
use crate::evolution::records::{
    FrameState, FrettingLoop, IncrementRecord, Observer, Outcome, Resultants, RollingRecord,
};
use crate::frame::ContactFrame;
use crate::geometry::GridSymmetry;
use crate::laws::friction::FrictionEllipse;
use crate::laws::wear::SpecificWearRate;

/// Largest difference of what the image has from what its model gives, relative.
const AGREES: f64 = 1e-9;

/// Entries with their fields; a copy shares them.
#[derive(Debug, Clone)]
pub struct Entries {
    list: Vec<Arc<(IncrementRecord, FrameState)>>,
    /// Bytes that may still be taken; `None` once they did not suffice.
    left: Option<usize>,
}

impl Entries {
    /// None yet, in so many bytes at most.
    pub fn up_to(bytes: usize) -> Self {
        Self { list: Vec::new(), left: Some(bytes) }
    }

    /// Adds an entry; without memory for it all are forgotten.
    pub fn add(&mut self, record: &IncrementRecord, state: &FrameState) {
        let numbers = [&state.tractions, &state.gap, &state.slip, &state.wear_depth]
            .map(Vec::len)
            .iter()
            .sum::<usize>();
        let bytes = 8 * numbers + state.status.len() + size_of::<(IncrementRecord, FrameState)>();
        self.left = self.left.and_then(|left| left.checked_sub(bytes));
        match self.left {
            Some(_) => self.list.push(Arc::new((record.clone(), state.clone()))),
            None => self.list.clear(),
        }
    }
}

/// All of a run that converged on one frame.
#[derive(Debug)]
pub struct Recording {
    frame: ContactFrame,
    /// `[3, N]` by planes, mm.
    initial_gap: Vec<f64>,
    ellipse: Option<FrictionEllipse>,
    intensity: Option<SpecificWearRate>,
    entries: Vec<Arc<(IncrementRecord, FrameState)>>,
    warnings: Vec<String>,
    loops: Vec<FrettingLoop>,
}

impl Recording {
    /// That of a run on `model`; `None` if it did not converge there, its entries did not hold all of it, or what it tells names a direction.
    pub fn new(model: &Model, result: &RunResult, entries: Entries) -> Option<Self> {
        let ended = result.frame_edge_checkpoint.is_none() && result.rebuild_checkpoint.is_none();
        let complete = entries.left.is_some() && entries.list.len() == result.records.len();
        let directed = result.warnings.iter().any(|warning| names_direction(warning));
        (result.outcome == Outcome::Converged && ended && complete && !directed).then(|| Self {
            frame: model.frame.clone(),
            initial_gap: model.initial_gap.clone(),
            ellipse: model.friction.ellipse(),
            intensity: model.wear.specific_rate(model.friction.ellipse()),
            entries: entries.list,
            warnings: result.warnings.clone(),
            loops: result.fretting_loops.clone(),
        })
    }

    /// Seconds that its entries took.
    pub fn seconds(&self) -> f64 {
        self.entries.iter().map(|entry| entry.0.seconds).sum()
    }

    /// Delivers its image under `symmetry` as the run of `model`; `None`, and nothing delivered, if that is not the model of the image.
    ///
    /// # Errors
    /// If the observer cannot write.
    pub fn deliver_image(
        &self,
        model: &Model,
        symmetry: GridSymmetry,
        observer: &mut dyn Observer,
    ) -> crate::error::Result<Option<RunResult>> {
        let Some(cells) = self.cells(model, symmetry) else { return Ok(None) };
        let image = Image { symmetry, cells };
        if !self.has_laws(model, &image) {
            return Ok(None);
        }
        let mut result = RunResult {
            records: Vec::new(),
            outcome: Outcome::Converged,
            skipped: Vec::new(),
            warnings: self.warnings.clone(),
            timings: Vec::new(),
            fretting_loops: self.loops.iter().map(|fretting| image.of_loop(fretting)).collect(),
            state: FrameState::default(),
            frame_edge_checkpoint: None,
            rebuild_checkpoint: None,
        };
        let started = Instant::now();
        let mut check = Check::new(model);
        for entry in &self.entries {
            if observer.cancelled() {
                return Ok(Some(RunResult { outcome: Outcome::Interrupted, ..result }));
            }
            if !check.holds(&image.of_state(&entry.1)) {
                return Ok(None);
            }
        }
        result.timings.push(("image".to_owned(), started.elapsed().as_secs_f64()));
        for (number, entry) in self.entries.iter().enumerate() {
            if observer.cancelled() {
                return Ok(Some(RunResult { outcome: Outcome::Interrupted, ..result }));
            }
            let clock = Instant::now();
            let (mut record, state) = (image.of_record(&entry.0), image.of_state(&entry.1));
            observer.progress(&record.name, number as f64 / self.entries.len() as f64, None);
            record.seconds = clock.elapsed().as_secs_f64();
            observer.increment_done(&record, &state)?;
            result.records.push(record);
            result.state = state;
        }
        Ok(Some(result))
    }

    /// Of each cell its image on the frame of `model`, if that is the image of this frame with its initial gap.
    fn cells(&self, model: &Model, symmetry: GridSymmetry) -> Option<Vec<usize>> {
        let (own, theirs) = (self.frame.grid?, model.frame.grid?);
        let near = |(a, b): (f64, f64)| (a - b).abs() <= AGREES * a.abs();
        let sides = symmetry.swap_axes(own.spacing).into_iter().zip(theirs.spacing).all(near);
        let same = symmetry.swap_axes(own.cells) == theirs.cells
            && symmetry.swap_axes(own.periodic) == theirs.periodic;
        if !sides || !same || self.frame.n_cells() != model.frame.n_cells() {
            return None;
        }
        let places = symmetry.cell_permutation(own.cells);
        let number = |place: usize| match &model.frame.grid_indices {
            Some(places) => places.binary_search(&place).ok(),
            None => Some(place),
        };
        let image =
            |cell: usize| number(places[self.frame.grid_indices.as_ref().map_or(cell, |own| own[cell])]);
        let cells = (0..self.frame.n_cells()).map(image).collect::<Option<Vec<_>>>()?;
        let image = Image { symmetry, cells };
        let gap = image.of_vectors(&self.initial_gap);
        let scale = gap.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let alike = gap.iter().zip(&model.initial_gap).all(|(a, b)| (a - b).abs() <= AGREES * scale);
        alike.then_some(image.cells)
    }

    /// Whether the laws of `model` are the images of its own.
    fn has_laws(&self, model: &Model, image: &Image) -> bool {
        let ellipse = |law: FrictionEllipse| (law.mu, law.angle);
        let intensity = |law: SpecificWearRate| (law.i, law.angle);
        let friction = model.friction.ellipse();
        let wear = model.wear.specific_rate(friction);
        image.is_law(self.ellipse.map(ellipse), friction.map(ellipse))
            && image.is_law(self.intensity.map(intensity), wear.map(intensity))
    }
}

/// Makes images of what a run leaves. Every field is named: one that is added does not compile until it has an image.
struct Image {
    symmetry: GridSymmetry,
    /// Of each cell that of its image.
    cells: Vec<usize>,
}

impl Image {
    /// Whether one law, by its values along two axes and the angle of the first, is the image of another.
    fn is_law(&self, of: Option<([f64; 2], f64)>, law: Option<([f64; 2], f64)>) -> bool {
        let tensor = |([first, second], angle): ([f64; 2], f64), symmetry: GridSymmetry| {
            let (sin, cos) = angle.sin_cos();
            let axes = [[cos, sin], [-sin, cos]].map(|axis| Vector2::from(symmetry.apply(axis)));
            axes[0] * axes[0].transpose() * first + axes[1] * axes[1].transpose() * second
        };
        match (of, law) {
            (None, None) => true,
            (Some(of), Some(law)) => {
                let (of, law): (Matrix2<f64>, Matrix2<f64>) =
                    (tensor(of, self.symmetry), tensor(law, GridSymmetry::IDENTITY));
                (of - law).amax() <= AGREES * law.amax()
            }
            _ => false,
        }
    }

    /// Of values by cell, `[N]`.
    fn of_scalars<T: Copy + Default>(&self, values: &[T]) -> Vec<T> {
        let mut image = vec![T::default(); values.len()];
        self.cells.iter().zip(values).for_each(|(&cell, value)| image[cell] = *value);
        image
    }

    /// Of vectors by planes, `[2, N]` or `[3, N]`: along x and y, and along n where they have it.
    fn of_vectors(&self, values: &[f64]) -> Vec<f64> {
        let n = self.cells.len();
        let mut image = vec![0.0; values.len()];
        for (cell, &to) in self.cells.iter().enumerate().filter(|_| !values.is_empty()) {
            let [x, y] = self.symmetry.apply([values[cell], values[n + cell]]);
            (image[to], image[n + to]) = (x, y);
            if values.len() == 3 * n {
                image[2 * n + to] = values[2 * n + cell];
            }
        }
        image
    }

    fn of_state(&self, state: &FrameState) -> FrameState {
        let FrameState { tractions, gap, slip, status, wear_depth } = state;
        FrameState {
            tractions: self.of_vectors(tractions),
            gap: self.of_vectors(gap),
            slip: self.of_vectors(slip),
            status: self.of_scalars(status),
            wear_depth: self.of_scalars(wear_depth),
        }
    }

    fn of_turn(&self, [x, y]: [f64; 2], n: f64) -> ([f64; 2], f64) {
        let [x, y, n] = self.symmetry.apply_axial([x, y, n]);
        ([x, y], n)
    }

    fn of_end(&self, end: &Resultants) -> Resultants {
        let mut image = *end;
        let Resultants {
            shift,
            rotation,
            twist,
            tangential_force,
            moment,
            normal_force: _,
            contact_area: _,
            stick_area: _,
            peak_pressure: _,
        } = &mut image;
        (*rotation, *twist) = self.of_turn(*rotation, *twist);
        for vector in [shift, tangential_force] {
            *vector = self.symmetry.apply(*vector);
        }
        *moment = self.symmetry.apply_axial(*moment);
        image
    }

    fn of_rolling(&self, rolling: RollingRecord) -> RollingRecord {
        let hand = self.symmetry.handedness();
        let RollingRecord { creepage: [along, left], spin, distance } = rolling;
        RollingRecord { creepage: [along, hand * left + 0.0], spin: hand * spin + 0.0, distance }
    }

    fn of_record(&self, record: &IncrementRecord) -> IncrementRecord {
        let mut image = record.clone();
        let IncrementRecord {
            shift,
            rotation,
            twist,
            tangential_force,
            moment,
            stroke_ends,
            rolling,
            name: _,
            increment: _,
            approach: _,
            normal_force: _,
            contact_area: _,
            stick_area: _,
            peak_pressure: _,
            contact_touches_edge: _,
            worn_volume: _,
            worn_volume_by_body: _,
            worn_volume_error: _,
            worn_volume_by_energy: _,
            max_wear_depth: _,
            wear_depth_error: _,
            cycles_done: _,
            distance_slid: _,
            dissipation: _,
            certificate: _,
            method: _,
            iterations: _,
            operator_applications: _,
            seconds: _,
            converged: _,
            jump: _,
        } = &mut image;
        (*rotation, *twist) = self.of_turn(*rotation, *twist);
        for vector in [shift, tangential_force] {
            *vector = self.symmetry.apply(*vector);
        }
        *moment = self.symmetry.apply_axial(*moment);
        *stroke_ends = stroke_ends.map(|ends| ends.map(|end| self.of_end(&end)));
        *rolling = rolling.map(|rolling| self.of_rolling(rolling));
        image
    }

    fn of_loop(&self, fretting: &FrettingLoop) -> FrettingLoop {
        let point = |[x, y, fx, fy, force]: &[f64; 5]| {
            let ([x, y], [fx, fy]) = (self.symmetry.apply([*x, *y]), self.symmetry.apply([*fx, *fy]));
            [x, y, fx, fy, *force]
        };
        let FrettingLoop { name, cycles_done, dissipation, points } = fretting.clone();
        FrettingLoop { name, cycles_done, dissipation, points: points.iter().map(point).collect() }
    }
}

/// Evaluates gaps again.
struct Check<'m> {
    model: &'m Model,
    /// S P, `[3, N]` by planes, mm.
    elastic: Vec<f64>,
    /// Coordinates of the cells along the frame's x and y, `[N]`, mm.
    places: Vec<[f64; 2]>,
}

impl<'m> Check<'m> {
    fn new(model: &'m Model) -> Self {
        let n = model.frame.n_cells();
        let places = (0..n).map(|cell| model.frame.plane_coordinates(cell)).collect();
        Self { model, elastic: vec![0.0; 3 * n], places }
    }

    /// Whether the normal gap of `state` is that of its tractions in the model, g = g0 + S P + worn depth, but for a rigid motion.
    ///
    /// # Source
    /// docs/theory-contact.md, the gap.
    fn holds(&mut self, state: &FrameState) -> bool {
        let n = self.places.len();
        if state.tractions.len() != 3 * n || state.gap.len() != 3 * n || state.wear_depth.len() != n {
            return false;
        }
        self.model.flexibility.apply(&state.tractions, &mut self.elastic);
        let normal = |values: &[f64], cell: usize| values[2 * n + cell];
        let rest: Vec<f64> = (0..n)
            .map(|cell| {
                let elastic = normal(&self.elastic, cell) + state.wear_depth[cell];
                normal(&state.gap, cell) - normal(&self.model.initial_gap, cell) - elastic
            })
            .collect();
        let size = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let scale = size(&self.elastic[2 * n..]).max(size(&state.wear_depth));
        // What is rounded of a gap that is much larger than what loads make of it.
        let rounding = 8.0 * f64::EPSILON * size(&self.model.initial_gap[2 * n..]);
        // The cells' centres lie evenly about the middle of a whole grid; of a part of one about their own.
        let count = n as f64;
        let middle = [0, 1].map(|axis| self.places.iter().map(|place| place[axis]).sum::<f64>() / count);
        let mean = rest.iter().sum::<f64>() / count;
        let (mut squares, mut slopes) = (Matrix2::zeros(), Vector2::zeros());
        for (place, value) in self.places.iter().zip(&rest) {
            let from = Vector2::new(place[0] - middle[0], place[1] - middle[1]);
            squares += from * from.transpose();
            slopes += from * (value - mean);
        }
        // A single row of cells turns about itself as it likes.
        let turn = squares.svd(true, true).solve(&slopes, 1e-12 * squares.amax()).unwrap_or_default();
        self.places.iter().zip(&rest).all(|(place, value)| {
            let rigid = mean + turn.x * (place[0] - middle[0]) + turn.y * (place[1] - middle[1]);
            (value - rigid).abs() <= AGREES * scale.max(mean.abs()) + rounding
        })
    }
}
