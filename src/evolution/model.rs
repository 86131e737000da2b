//! Model of a run: contact frame, flexibility, initial gap, friction law and wear law. `PreparedModel` adds derived
//! quantities. N is the number of cells.

use std::sync::{Arc, Mutex};

use nalgebra::{Matrix3, Vector3};

use crate::body::rigid_body_modes::unconstrained_translations;
use crate::body::{BodyLoad, UnconstrainedModes};
use crate::contact::balance::MAX_RIGID_MODES;
use crate::contact::{ContactScales, ContactState};
use crate::error::{Error, Result};
use crate::evolution::step::Step;
use crate::flexibility::Flexibility;
use crate::frame::ContactFrame;
use crate::geometry::{Triad, bounds};
use crate::laws::friction::{FrictionEllipse, FrictionLaw};
use crate::laws::wear::{SpecificWearRate, WearLaw};
use crate::linalg::hierarchical::ClusterTree;

/// Largest number of cells of a patch. The factors of its system of equations take 5 MB.
const MAX_PATCH_CELLS: usize = 256;

/// Largest variation of the normal gap with which surfaces count as parallel, divided by the size of the frame.
const LEVEL_TOLERANCE: f64 = 1e-9;

/// Inputs of a run.
pub struct Model {
    /// The contact frame.
    pub frame: ContactFrame,
    /// Flexibility operator S of both bodies, for the cells of the frame.
    pub flexibility: Arc<dyn Flexibility>,
    /// Gap at zero tractions, zero rigid motion and zero amplitudes of the loads, `[3, N]` by components, mm.
    pub initial_gap: Vec<f64>,
    /// Loads of the bodies.
    pub loads: Vec<BodyLoad>,
    /// Rigid-body modes of unconstrained bodies; empty if both bodies are fixed.
    pub floating: Vec<UnconstrainedModes>,
    /// Friction law.
    pub friction: FrictionLaw,
    /// Wear law.
    pub wear: WearLaw,
    /// Share of the wear depth taken from body 1, 0..=1.
    pub wear_share: f64,
}

impl Model {
    /// Amplitudes of the loads before the first step: 1 for preloads, 0 for others.
    pub fn first_amplitudes(&self) -> Vec<f64> {
        self.loads.iter().map(|load| f64::from(u8::from(load.case.preload))).collect()
    }

    /// Initial gap with the loads at `amplitudes`, `[3, N]`, mm.
    pub fn loaded_gap(&self, amplitudes: &[f64]) -> Vec<f64> {
        let mut gap = self.initial_gap.clone();
        add_load_gaps(self, amplitudes, &mut gap);
        gap
    }

    /// Initial gap with all loads at amplitude 1, `[3, N]`, mm.
    pub fn gap_of_full_loads(&self) -> Vec<f64> {
        self.loaded_gap(&vec![1.0; self.loads.len()])
    }
}

pub(super) struct PreparedModel<'a> {
    pub model: &'a Model,
    pub ellipse: Option<FrictionEllipse>,
    /// Wear volume per friction energy, 1/MPa; `None` if the friction energy does not determine the wear volume.
    pub volume_per_energy: Option<f64>,
    scales: Mutex<Arc<ContactScales>>,
    /// Number of the patch to which each cell belongs, `[N]`; empty without meshed bodies. A patch is a group of
    /// neighbouring cells in the preconditioner of the solver.
    pub patches: Vec<usize>,
    /// Axes x, y, n of the frame.
    pub axes: Triad,
    pub edge: Vec<bool>,
    pub rigid_axes: Option<Vec<Matrix3<f64>>>,
    /// Initial gap, `[3, N]`, mm, with `first_touch` subtracted from the normal components. Without the subtraction,
    /// small gaps would be lost in rounding.
    pub initial_gap: Vec<f64>,
    /// `initial_gap` plus the change of the gap by the loads at their present amplitudes, `[3, N]`, mm.
    pub loaded_gap: Vec<f64>,
    /// Amplitudes of the loads at the + reversal point, for loads that vary in phase with the strokes of a step; 0 for
    /// other loads.
    pub cyclic_amplitudes: Vec<f64>,
    /// Change of the gap at the + reversal point by loads that vary in phase with the strokes of a step, `[3, N]`, mm.
    /// `None` without these loads.
    pub cyclic_gap: Option<Vec<f64>>,
    /// Approach at which the first cell closes, mm; 0 if the cells have different axes.
    pub first_touch: f64,
    /// Change of the gap per unit of each additional mode, `[3, N]`. Additional modes supplement the translations of
    /// body 2: rigid-body modes of unconstrained bodies, or rotations of body 2 that steps control.
    pub mode_gaps: Vec<Vec<f64>>,
    /// Translation and rotation of body 2 relative to body 1 in the frame's axes, for each additional mode.
    pub mode_motions: Vec<[f64; 6]>,
    /// Whether the additional modes are rotations of body 2 that steps control.
    pub controls_rotation: bool,
    /// Work of the loads at their present amplitudes on each rigid-body mode of unit amplitude, N mm per unit.
    pub mode_loads: Vec<f64>,
    /// Work on each rigid-body mode of unit amplitude at the + reversal point, N mm per unit. Only loads that vary in
    /// phase with the strokes of a step count.
    pub cyclic_mode_loads: Vec<f64>,
    /// Groups of cells whose flexibility has been formed during the run, in the order of formation.
    formed_cells: Mutex<Vec<Vec<usize>>>,
    /// Orthonormal basis of the translations in which unconstrained bodies can move.
    pub free_translations: Vec<Vector3<f64>>,
}

fn check_sizes(model: &Model) -> Result<()> {
    let n = model.frame.n_cells();
    if n == 0 {
        return Err(Error::input("the contact frame has no cells"));
    }
    if model.initial_gap.len() != 3 * n || model.flexibility.n_cells() != n {
        return Err(Error::numerical(format!(
            "the sizes do not match: the frame has {n} cells, the gap {} values and the flexibility {} cells",
            model.initial_gap.len(),
            model.flexibility.n_cells()
        )));
    }
    let misfit = |body: &UnconstrainedModes| {
        let loads = model.loads.iter().filter(|load| load.side == Some(body.side)).count();
        body.modes.iter().any(|mode| mode.load_work.len() != loads)
    };
    if model.loads.iter().any(|load| load.gap.len() != 3 * n) || model.floating.iter().any(misfit) {
        return Err(Error::numerical(
            "the loads of the bodies do not match this frame and its rigid-body modes",
        ));
    }
    if let Some(bad) = model.initial_gap.iter().position(|g| !g.is_finite()) {
        return Err(Error::input(format!("the initial gap of cell {} is not a finite number", bad % n)));
    }
    Ok(())
}

fn contact_scales(model: &Model, ellipse: Option<&FrictionEllipse>) -> Result<ContactScales> {
    if let Some(mu) = ellipse.into_iter().flat_map(|e| e.mu).find(|mu| !(1.0 / mu).is_finite()) {
        return Err(Error::input(format!(
            "the friction coefficient {mu:e} is too small to be inverted: give each coefficient a value above 1e-300, or use no friction"
        )));
    }
    let scales = ContactScales::new(model.flexibility.as_ref(), ellipse);
    let bad_scale = |c: &f64| !(c.is_finite() && *c > 0.0);
    if let Some(cell) = scales.c_normal.iter().position(bad_scale) {
        return Err(Error::numerical(format!(
            "the normal flexibility of cell {cell} is not positive: the operator is invalid"
        )));
    }
    Ok(scales)
}

/// Number of the patch to which each cell belongs, `[N]`; empty without meshed bodies.
fn patches(model: &Model) -> Vec<usize> {
    if !model.flexibility.is_condensed() {
        return Vec::new();
    }
    let centers: Vec<[f64; 3]> = model.frame.centers.iter().map(|&center| center.into()).collect();
    let extents: Vec<[[f64; 3]; 2]> = centers.iter().map(|&center| [center; 2]).collect();
    let tree = ClusterTree::new(&centers, &extents, MAX_PATCH_CELLS);
    let mut patches = vec![0; centers.len()];
    for (patch, places) in tree.clusters_of_size(MAX_PATCH_CELLS).into_iter().enumerate() {
        tree.order[places].iter().for_each(|&cell| patches[cell] = patch);
    }
    patches
}

impl<'a> PreparedModel<'a> {
    pub fn new(model: &'a Model, steps: &[Step]) -> Result<Self> {
        check_sizes(model)?;
        let n = model.frame.n_cells();
        let with_friction = steps.iter().any(|step| step.friction);
        let ellipse = if with_friction { model.friction.ellipse() } else { None };
        let scales = contact_scales(model, ellipse.as_ref())?;
        let axes = model.frame.axes;
        let rigid_axes = rigid_axes(&model.frame, &axes);
        let mut initial_gap = model.initial_gap.clone();
        let first_touch = first_touch_approach(model.frame.has_uniform_axes(), &initial_gap[2 * n..]);
        initial_gap[2 * n..].iter_mut().for_each(|g| *g -= first_touch);
        let motions: Vec<_> = model.floating.iter().flat_map(|body| &body.modes).collect();
        if motions.len() > MAX_RIGID_MODES || motions.iter().any(|motion| motion.gap.len() != 3 * n) {
            return Err(Error::numerical("the rigid-body modes do not match this frame and pair of bodies"));
        }
        let controls_rotation = steps.iter().any(|step| step.tilt.is_some() || step.spin.is_some());
        let mut mode_motions: Vec<[f64; 6]> = motions.iter().map(|motion| motion.relative_motion).collect();
        let mut mode_gaps: Vec<Vec<f64>> = motions.iter().map(|motion| motion.gap.clone()).collect();
        let n_free = motions.len();
        let free_translations = unconstrained_translations(&mode_motions, model.frame.size());
        if controls_rotation {
            if !motions.is_empty() {
                return Err(Error::input(
                    "rotations and moments can be prescribed only for fixed bodies, because an unconstrained body rotates under its own loads: support the body, or prescribe neither",
                ));
            }
            for axis in 0..3 {
                let mut motion = [0.0; 6];
                motion[3 + axis] = 1.0;
                mode_motions.push(motion);
                mode_gaps.push(rotation_gap(&model.frame, axis));
            }
        }
        let mut prepared = Self {
            mode_loads: vec![0.0; n_free],
            cyclic_mode_loads: vec![0.0; n_free],
            mode_gaps,
            free_translations,
            mode_motions,
            controls_rotation,
            model,
            ellipse,
            volume_per_energy: (model.wear.specific_rate(ellipse))
                .zip(ellipse)
                .and_then(|(wear, ellipse)| wear.volume_per_energy(&ellipse)),
            scales: Mutex::new(Arc::new(scales)),
            patches: patches(model),
            formed_cells: Mutex::new(Vec::new()),
            axes,
            edge: model.frame.edge_cells(),
            rigid_axes,
            loaded_gap: initial_gap.clone(),
            cyclic_amplitudes: vec![0.0; model.loads.len()],
            cyclic_gap: None,
            initial_gap,
            first_touch,
        };
        prepared.apply_loads(&model.first_amplitudes());
        Ok(prepared)
    }

    /// Whether the undeformed surfaces are parallel, so that all cells close at once.
    pub fn starts_level(&self) -> bool {
        let [least, largest] = bounds(self.initial_gap[2 * self.n()..].iter().copied());
        let tolerance = LEVEL_TOLERANCE * self.model.frame.size();
        let closed = largest <= tolerance;
        largest - least <= tolerance && (closed || self.model.frame.has_uniform_axes())
    }

    /// Sets the amplitudes a_k of the loads. The gap becomes g_0 + Σ_k a_k g_k, with the initial gap g_0 and the change
    /// g_k by load k at amplitude 1.
    pub fn apply_loads(&mut self, amplitudes: &[f64]) {
        let model = self.model;
        if model.loads.is_empty() {
            return;
        }
        self.loaded_gap.copy_from_slice(&self.initial_gap);
        add_load_gaps(model, amplitudes, &mut self.loaded_gap);
        self.mode_loads = mode_loads(model, amplitudes);
    }

    /// Sets the amplitudes of the loads that vary in phase with the strokes of `step`.
    pub fn apply_cyclic_loads(&mut self, step: &Step) {
        let model = self.model;
        let named = |load: &BodyLoad| {
            step.cyclic_loads
                .iter()
                .find(|(name, _)| load.case.name.as_ref() == Some(name))
                .map(|(_, by)| *by)
        };
        let varying: Vec<Option<f64>> = model.loads.iter().map(named).collect();
        let amplitudes: Vec<f64> = varying.iter().map(|amplitude| amplitude.unwrap_or(0.0)).collect();
        self.cyclic_gap = varying.iter().any(Option::is_some).then(|| {
            let mut gap = vec![0.0; 3 * model.frame.n_cells()];
            add_load_gaps(model, &amplitudes, &mut gap);
            gap
        });
        self.cyclic_mode_loads = mode_loads(model, &amplitudes);
        self.cyclic_amplitudes = amplitudes;
    }

    /// Motion of body 2 relative to body 1 at the frame's origin along x, y, n, including the additional modes.
    pub fn motion(&self, rigid: &[f64; 3], floating: &[f64; MAX_RIGID_MODES]) -> [f64; 3] {
        let mut sum = *rigid;
        for (motion, amount) in self.mode_motions.iter().zip(floating) {
            (0..3).for_each(|k| sum[k] += amount * motion[k]);
        }
        sum
    }

    /// Rotation of body 2 relative to body 1 about x, y, n, radians.
    pub fn rotation(&self, floating: &[f64; MAX_RIGID_MODES]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (motion, amount) in self.mode_motions.iter().zip(floating) {
            (0..3).for_each(|k| sum[k] += amount * motion[3 + k]);
        }
        sum
    }

    /// Returns the mode amplitudes `now`. If steps control the rotation of body 2, `turn` (about x, y, n) replaces the
    /// rotation in `now`.
    pub fn with_rotation(&self, mut now: [f64; MAX_RIGID_MODES], turn: [f64; 3]) -> [f64; MAX_RIGID_MODES] {
        if self.controls_rotation {
            now[..3].copy_from_slice(&turn);
        }
        now
    }

    pub fn approach(&self, it: &ContactState, end: usize) -> f64 {
        self.approach_of(&it.rigid_motion[end], &it.mode_amplitudes[end])
    }

    pub fn approach_of(&self, rigid: &[f64; 3], floating: &[f64; MAX_RIGID_MODES]) -> f64 {
        let approach = self.first_touch - self.motion(rigid, floating)[2];
        // A difference this small is rounding error.
        if approach.abs() <= 2.0 * f64::EPSILON * self.first_touch.abs() { 0.0 } else { approach }
    }

    /// Projects a direction (x, y, n) onto the space of translations in which unconstrained bodies can move.
    pub fn free_part(&self, direction: Vector3<f64>) -> Vector3<f64> {
        self.free_translations.iter().map(|free| free * free.dot(&direction)).sum()
    }

    pub fn normal_is_free(&self) -> bool {
        (self.free_part(Vector3::z()) - Vector3::z()).norm() < 1e-6
    }

    /// Specific wear rate of a step in which wear and friction act as stated. `None` without wear, and for the energy
    /// law without friction.
    pub fn specific_wear_rate(&self, wear: bool, friction: bool) -> Option<SpecificWearRate> {
        self.model.wear.specific_rate(self.ellipse.filter(|_| friction)).filter(|_| wear)
    }

    pub fn scales(&self) -> Arc<ContactScales> {
        self.scales.lock().expect("no panic while the scales are held").clone()
    }

    pub fn formed_cells(&self) -> Vec<Vec<usize>> {
        self.formed_cells.lock().expect("no panic while the list is held").clone()
    }

    /// Forms the flexibility of additional cells and returns the scales of the extended operator.
    pub fn form_flexibility(&self, cells: &[usize]) -> Result<Arc<ContactScales>> {
        self.model.flexibility.form_rows(cells)?;
        self.formed_cells.lock().expect("no panic while the list is held").push(cells.to_vec());
        let scales = Arc::new(ContactScales::new(self.model.flexibility.as_ref(), self.ellipse.as_ref()));
        *self.scales.lock().expect("no panic while the scales are held") = scales.clone();
        Ok(scales)
    }

    pub fn n(&self) -> usize {
        self.model.frame.n_cells()
    }

    /// Force and moment (about the frame's origin) on body 1 in the frame's axes, caused by the tractions on body 2.
    pub fn resultants(&self, tractions: &[f64]) -> ([f64; 3], [f64; 3]) {
        let n = self.n();
        let frame = &self.model.frame;
        let mut force = Vector3::zeros();
        let mut moment = Vector3::zeros();
        for i in 0..n {
            let local = Vector3::new(tractions[i], tractions[n + i], tractions[2 * n + i]);
            let on_body1 = -frame.triads[i].to_global(&local) * frame.areas[i];
            force += on_body1;
            moment += (frame.centers[i] - frame.origin).cross(&on_body1);
        }
        (self.axes.to_local(&force).into(), self.axes.to_local(&moment).into())
    }
}

/// Adds Σ_k a_k g_k to `gap`. a_k are the `amplitudes` of the loads of `model`. g_k is the change of the gap by load k
/// at amplitude 1.
fn add_load_gaps(model: &Model, amplitudes: &[f64], gap: &mut [f64]) {
    for (load, amplitude) in model.loads.iter().zip(amplitudes) {
        gap.iter_mut().zip(&load.gap).for_each(|(sum, by)| *sum += amplitude * by);
    }
}

/// Work of the loads at `amplitudes` on each rigid-body mode of unit amplitude, N mm per unit.
fn mode_loads(model: &Model, amplitudes: &[f64]) -> Vec<f64> {
    let mut sums = Vec::new();
    for body in &model.floating {
        let loads = model.loads.iter().zip(amplitudes).filter(|(load, _)| load.side == Some(body.side));
        let own: Vec<f64> = loads.map(|(_, amplitude)| *amplitude).collect();
        let work = |work: &Vec<f64>| work.iter().zip(&own).map(|(work, amplitude)| work * amplitude).sum();
        sums.extend(body.modes.iter().map(|mode| -> f64 { work(&mode.load_work) }));
    }
    sums
}

pub(super) fn first_touch_approach(level: bool, normal_gap: &[f64]) -> f64 {
    if level { normal_gap.iter().copied().fold(f64::INFINITY, f64::min) } else { 0.0 }
}

/// Change of the gap per radian of rotation of body 2, in the axes of each cell, `[3, N]` by components. Body 2 rotates
/// about an axis of the frame through the frame's origin. Components across planes of symmetry are removed.
fn rotation_gap(frame: &ContactFrame, axis: usize) -> Vec<f64> {
    let n = frame.n_cells();
    let direction: Vector3<f64> = frame.axes.0.column(axis).into();
    let mut gap = vec![0.0; 3 * n];
    let projectors = frame.symmetry_projectors();
    for (cell, (center, triad)) in frame.centers.iter().zip(frame.triads.iter()).enumerate() {
        let local = triad.to_local(&direction.cross(&(center - frame.origin)));
        let on_plane = projectors.binary_search_by_key(&cell, |projector| projector.0);
        let local = on_plane.map_or(local, |index| projectors[index].1 * local);
        (0..3).for_each(|plane| gap[plane * n + cell] = local[plane]);
    }
    gap
}

/// Matrix of each cell that transforms a rigid motion from the frame's axes to the axes of the cell. Components across
/// planes of symmetry are removed. `None` if every matrix is the identity.
fn rigid_axes(frame: &ContactFrame, axes: &Triad) -> Option<Vec<Matrix3<f64>>> {
    let projectors = frame.symmetry_projectors();
    if frame.has_uniform_axes() && projectors.is_empty() {
        return None;
    }
    // With uniform axes, the product in the other branch would differ from the identity by rounding errors.
    let mut matrices = if frame.has_uniform_axes() {
        vec![Matrix3::identity(); frame.n_cells()]
    } else {
        frame.triads.map(|t| t.0.transpose() * axes.0).into_vec()
    };
    projectors.iter().for_each(|(cell, projector)| matrices[*cell] = projector * matrices[*cell]);
    Some(matrices)
}
