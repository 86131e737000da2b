//! Field output of a run, increment by increment: `.vtu` files, `.pvd` collections, figures.

use std::cell::OnceCell;
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::body::{ErrorEstimation, PointState};
use crate::error::{Context, Result};
use crate::evolution::records::{FrameState, IncrementRecord};
use crate::frame::ContactFrame;
use crate::output::body_fields::{BodyOutput, RecoveryLocation, surface_grid};
use crate::output::body_peaks::BodyRecord;
use crate::output::frame_fields::{FrameMesh, frame_grid, planes_to_triples};
use crate::output::history_table::loops_csv;
use crate::output::interior_points::InteriorPointRequest;
use crate::output::output_dir::OutputDir;
use crate::output::plot::loops::{LoopCurve, loops_svg};
use crate::output::run_figures::RunFigures;
use crate::output::summary::Summary;
use crate::output::surface_properties::SurfaceProperties;
use crate::output::volume::volume_grid;
use crate::output::vtu::{UnstructuredGrid, pvd_collection};

/// Kinds of fields that a scene may ask for in `output.fields`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FieldKind {
    /// Fields on the contact frame and on the surfaces of the bodies.
    Vtu,
    /// Displacement, stress and failure indices in the volume of finite-element bodies, with the error estimate.
    Volume,
    /// Stress on the surfaces of meshed bodies, with peaks in the volume (finite elements) or on the surface (boundary elements).
    Stress,
    /// Estimated error of the stress in finite-element bodies.
    Error,
    /// Figures: maps of pressure, slip, stick and slip zones, and wear; profiles; and the history of forces, areas and wear.
    Svg,
    /// Fretting loops, tangential force over displacement: cycles at the start and the end of each step with cycles.
    Loops,
}

impl FieldKind {
    /// Whether the stress in the bodies is required.
    pub fn require_stress(wanted: &[Self]) -> bool {
        wanted.iter().any(|kind| matches!(kind, Self::Volume | Self::Stress | Self::Error))
    }

    /// Whether the error of the stress is required.
    pub fn error_estimate(wanted: &[Self]) -> ErrorEstimation {
        let needed = wanted.iter().any(|kind| matches!(kind, Self::Volume | Self::Error));
        if needed { ErrorEstimation::Estimate } else { ErrorEstimation::Skip }
    }
}

/// Displacement and stress at the points of a request, if the body provides them.
pub type PointStates = Option<Vec<PointState>>;

/// Writer of the requested fields of a frame and its bodies.
pub struct FieldWriter<'a> {
    frame: &'a ContactFrame,
    frame_mesh: OnceCell<FrameMesh>,
    bodies: Vec<BodyOutput<'a>>,
    kinds: Vec<FieldKind>,
    /// Requested points inside the bodies for displacement and stress.
    pub interior_points: Vec<InteriorPointRequest>,
    /// Stride of the written increments: an increment is written if its number in the step is a multiple of the stride. Increments
    /// that did not converge, cycle jumps and rolling entries are always written.
    pub increment_stride: usize,
    /// Plot axes and fibres of the surface, and the distribution of wear between the bodies.
    pub surface: SurfaceProperties,
    /// Field output so far.
    pub written: WrittenFields,
}

/// Field output so far: file series, and data of the figures and stress peaks that are written at the end of the run.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct WrittenFields {
    /// Number of the last written entry, from 1; 0 at first.
    last_entry: usize,
    series_files: BTreeMap<String, Vec<(f64, String)>>,
    pictures: RunFigures,
    peaks: Vec<BodyRecord>,
}

/// State of a writer before an entry.
#[derive(Debug, Clone, Copy)]
pub struct FieldRollback {
    last_entry: usize,
    peaks: usize,
}

impl WrittenFields {
    /// Removes the `missing` files from the series.
    pub fn remove_missing_files(&mut self, missing: &[String]) {
        for files in self.series_files.values_mut() {
            files.retain(|(_, name)| !missing.contains(name));
        }
    }

    /// Transfers the data to an enlarged frame, as [`RunFigures::transfer_to`].
    pub fn transfer_to(mut self, places: &[usize], n: usize) -> Self {
        self.pictures.transfer_to(places, n);
        self
    }
}

impl<'a> FieldWriter<'a> {
    /// Creates a writer of the `wanted` fields of `frame` and `bodies`.
    pub fn new(frame: &'a ContactFrame, bodies: Vec<BodyOutput<'a>>, wanted: &[FieldKind]) -> Self {
        Self {
            frame,
            frame_mesh: OnceCell::new(),
            bodies,
            kinds: wanted.to_vec(),
            interior_points: Vec::new(),
            increment_stride: 1,
            surface: SurfaceProperties::default(),
            written: WrittenFields::default(),
        }
    }

    /// Whether the fields of this entry are written.
    pub fn selects(&self, record: &IncrementRecord) -> bool {
        let monotone = record.jump.is_none() && record.rolling.is_none();
        !monotone || !record.converged || record.increment.is_multiple_of(self.increment_stride)
    }

    fn frame_mesh(&self) -> &FrameMesh {
        self.frame_mesh.get_or_init(|| FrameMesh::new(self.frame))
    }

    /// Whether fretting loops are requested.
    pub fn wants_loops(&self) -> bool {
        self.kinds.contains(&FieldKind::Loops)
    }

    /// Whether any field is requested.
    pub fn has_output(&self) -> bool {
        !self.kinds.is_empty()
    }

    /// Writes the fields of an entry; `number` is its position in `summary.steps`, from 1.
    ///
    /// # Errors
    /// If a file cannot be written (kind `Resources`). If a field is not finite (kind `Numerical`). If a field cannot be recovered,
    /// or the run is cancelled.
    pub fn write_entry(
        &mut self,
        output: &mut OutputDir,
        number: usize,
        record: &IncrementRecord,
        state: &FrameState,
        inside: Vec<PointStates>,
    ) -> Result<()> {
        if !self.selects(record) {
            return Ok(());
        }
        self.written.last_entry = number;
        if self.kinds.contains(&FieldKind::Vtu) {
            let grid = frame_grid(self.frame, self.frame_mesh(), &self.surface, state)?;
            self.write_grid(output, "frame", &grid)?;
        }
        for body in self.bodies.clone() {
            let meshed = matches!(body.location, RecoveryLocation::MeshNodes { .. });
            if self.kinds.contains(&FieldKind::Vtu) || (meshed && FieldKind::require_stress(&self.kinds)) {
                self.write_body(output, &body, record, state)
                    .context(|| format!("fields of {}", body.side.key()))?;
            }
        }
        for (request, states) in self.interior_points.clone().iter().zip(&inside) {
            self.write_interior_points(output, request, states)
                .context(|| format!("output.inside, \"{}\"", request.name))?;
        }
        // The figures come last, because the output above may be cancelled and [`Self::roll_back`] does not undo
        // figures.
        if self.kinds.contains(&FieldKind::Svg) {
            self.written.pictures.record_entry(self.frame.n_cells(), record, state);
        }
        Ok(())
    }

    /// State before an entry, for [`FieldWriter::roll_back`].
    pub fn rollback_mark(&self) -> FieldRollback {
        FieldRollback { last_entry: self.written.last_entry, peaks: self.written.peaks.len() }
    }

    /// Discards the output of the entry that began at `mark` and was cancelled.
    pub fn roll_back(&mut self, mark: FieldRollback) {
        let WrittenFields { last_entry, series_files, pictures: _, peaks } = &mut self.written;
        *last_entry = mark.last_entry;
        peaks.truncate(mark.peaks);
        series_files.values_mut().for_each(|files| files.retain(|(time, _)| *time <= mark.last_entry as f64));
        series_files.retain(|_, files| !files.is_empty());
    }

    /// Recovers displacement and stress at the requested interior points.
    ///
    /// # Errors
    /// If the recovery fails or the run is cancelled.
    pub fn recover_interior_points(&self, state: &FrameState) -> Result<Vec<PointStates>> {
        let of = |request: &InteriorPointRequest| {
            let body = self.bodies.iter().find(|body| body.side == request.side);
            let points = request.points();
            let states =
                body.map(|body| body.body.recover_at_points(self.frame, body.loading(state), &points));
            states.transpose().map(Option::flatten).context(|| format!("output.inside, \"{}\"", request.name))
        };
        self.interior_points.iter().map(of).collect()
    }

    fn write_interior_points(
        &mut self,
        output: &mut OutputDir,
        request: &InteriorPointRequest,
        states: &PointStates,
    ) -> Result<()> {
        // A body provides no states if a comparison has replaced its kind.
        let Some(states) = states else { return Ok(()) };
        let series = request.series();
        output.write_text(&format!("{series}_{:04}.csv", self.written.last_entry), &request.csv(states)?)?;
        if request.across.is_some() {
            self.write_grid(output, &series, &request.grid(states))?;
        }
        Ok(())
    }

    fn write_body(
        &mut self,
        output: &mut OutputDir,
        body: &BodyOutput<'a>,
        record: &IncrementRecord,
        state: &FrameState,
    ) -> Result<()> {
        let (name, wanted) = (body.side.key(), self.kinds.clone());
        let tractions = planes_to_triples(&state.tractions, self.frame.n_cells(), "traction")?;
        let loading = body.loading(state);
        let mut field = body.body.recover(loading)?;
        if FieldKind::require_stress(&wanted) {
            field.stress =
                body.body.recover_stress(loading, &field.displacement, FieldKind::error_estimate(&wanted))?;
        }
        if let Some(peaks) = body.peaks(self.frame, &field, &tractions) {
            let (step, increment) = (record.name.clone(), record.increment);
            self.written.peaks.push(BodyRecord { body: name.into(), name: step, increment, peaks });
        }
        let meshed = matches!(body.location, RecoveryLocation::MeshNodes { .. });
        if wanted.contains(&FieldKind::Vtu) || (meshed && wanted.contains(&FieldKind::Stress)) {
            let grid = surface_grid(body, self.frame, self.frame_mesh(), &field, &tractions)?;
            self.write_grid(output, name, &grid)?;
        }
        if let RecoveryLocation::MeshNodes { mesh, .. } = body.location
            && wanted.contains(&FieldKind::Volume)
            && mesh.volume_cells().next().is_some()
        {
            self.write_grid(output, &format!("{name}_volume"), &volume_grid(mesh, &field)?)?;
        }
        Ok(())
    }

    fn write_grid(&mut self, output: &mut OutputDir, series: &str, grid: &UnstructuredGrid) -> Result<()> {
        let number = self.written.last_entry;
        let file = format!("{series}_{number:04}.vtu");
        output.write(&file, |out| grid.write(out))?;
        let files = self.written.series_files.entry(series.to_owned()).or_default();
        files.push((number as f64, file));
        Ok(())
    }

    /// Writes the `.pvd` collections, the figures and the requested fretting loops. The time in a collection is the
    /// number of the entry. Moves the peaks to the summary.
    ///
    /// # Errors
    /// If a file cannot be written (kind `Resources`). If a number of the fretting loops is not finite (kind `Numerical`).
    pub fn finish(self, output: &mut OutputDir, summary: &mut Summary) -> Result<()> {
        let WrittenFields { series_files, pictures, peaks, .. } = self.written;
        summary.bodies = peaks;
        for (series, files) in series_files {
            output.write_text(&format!("{series}.pvd"), &pvd_collection(&files))?;
        }
        if !summary.loops.is_empty() {
            let loops: Vec<LoopCurve> = summary.loops.iter().map(LoopCurve::of).collect();
            output.write_text("loops.svg", &loops_svg(&loops, &summary.units))?;
            output.write_text("loops.csv", &loops_csv(&summary.loops)?)?;
        }
        pictures.write(self.frame, &self.surface, output, summary)
    }
}
