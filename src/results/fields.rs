//! Writes the fields of a run, increment by increment: `.vtu` files, the `.pvd` collections over them, pictures.

use std::cell::OnceCell;
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::body::{Estimate, PointState};
use crate::error::{Context, Result};
use crate::frame::ContactFrame;
use crate::history::record::{FrameState, IncrementRecord};
use crate::results::body_fields::{BodyOutput, BodyShape, surface_grid};
use crate::results::body_peaks::BodyRecord;
use crate::results::frame_fields::{FrameMesh, by_cell, frame_grid};
use crate::results::inside::InsideRequest;
use crate::results::output::{OutputDir, write_failure};
use crate::results::pictures::Pictures;
use crate::results::plot::loops::{Loop, loops_svg};
use crate::results::summary::Summary;
use crate::results::surface::Surface;
use crate::results::table::loops_csv;
use crate::results::volume::volume_grid;
use crate::results::vtu::{UnstructuredGrid, collection};

/// Kinds of fields that a scene may ask for in `output.fields`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FieldKind {
    /// Fields on the contact frame and on the surfaces of the bodies.
    Vtu,
    /// Displacement, stress and failure indices in the volume of finite-element bodies, with the error estimate.
    Volume,
    /// Stress on the surfaces of finite bodies, and the peaks in their volume, of boundary elements on their surface.
    Stress,
    /// Estimated error of the stress in finite-element bodies.
    Error,
    /// Maps, profiles and the course of the resultants, as pictures.
    Svg,
    /// Fretting loops: cycles at the start and the end of their steps, resolved into force over shift.
    Loops,
}

impl FieldKind {
    /// Whether the stress in the bodies is needed.
    pub fn need_stress(wanted: &[Self]) -> bool {
        wanted.iter().any(|kind| matches!(kind, Self::Volume | Self::Stress | Self::Error))
    }

    /// Whether its error is.
    pub fn estimate(wanted: &[Self]) -> Estimate {
        let needed = wanted.iter().any(|kind| matches!(kind, Self::Volume | Self::Error));
        if needed { Estimate::Wanted } else { Estimate::Skipped }
    }
}

/// Displacement and stress at the points of a request; `None` where the body has none.
pub type Inside = Option<Vec<PointState>>;

/// Writes what is asked for of a frame and its bodies.
pub struct FieldWriter<'a> {
    frame: &'a ContactFrame,
    /// Made when it is first written.
    mesh: OnceCell<FrameMesh>,
    bodies: Vec<BodyOutput<'a>>,
    wanted: Vec<FieldKind>,
    inside: Vec<InsideRequest>,
    /// Of the increments of a monotone step each so-manieth is written.
    every: usize,
    surface: Surface,
    written: Written,
}

/// What has been written so far, and what is kept for the end.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Written {
    increments: usize,
    /// Files of each series with their times.
    collections: BTreeMap<String, Vec<(f64, String)>>,
    pictures: Pictures,
    peaks: Vec<BodyRecord>,
}

/// How far a writer had come.
#[derive(Debug, Clone, Copy)]
pub struct Mark {
    increments: usize,
    peaks: usize,
}

impl Written {
    /// Takes files out that are no longer there.
    pub fn forget(&mut self, missing: &[String]) {
        for files in self.collections.values_mut() {
            files.retain(|(_, name)| !missing.contains(name));
        }
    }

    /// For a frame of `n` cells of which the ones so far are a part; `places`: their numbers there.
    pub fn onto(mut self, places: &[usize], n: usize) -> Self {
        self.pictures.onto(places, n);
        self
    }
}

impl<'a> FieldWriter<'a> {
    /// A writer of the `wanted` fields of `frame` and `bodies`.
    pub fn new(frame: &'a ContactFrame, bodies: Vec<BodyOutput<'a>>, wanted: &[FieldKind]) -> Self {
        Self {
            frame,
            mesh: OnceCell::new(),
            bodies,
            wanted: wanted.to_vec(),
            inside: Vec::new(),
            every: 1,
            surface: Surface::default(),
            written: Written::default(),
        }
    }

    /// Also writes displacement and stress at points inside the bodies.
    pub fn with_inside(self, inside: &[InsideRequest]) -> Self {
        Self { inside: inside.to_vec(), ..self }
    }

    /// Writes each so-manieth increment of monotone steps only, and those that did not converge.
    pub fn every(self, every: usize) -> Self {
        Self { every, ..self }
    }

    /// Whether it writes an entry.
    pub fn writes_at(&self, record: &IncrementRecord) -> bool {
        let monotone = record.jump.is_none() && record.rolling.is_none();
        !monotone || !record.converged || record.increment.is_multiple_of(self.every)
    }

    /// The same after what another one has written.
    pub fn after(mut self, written: Written) -> Self {
        self.written = written;
        self
    }

    /// What it has written so far.
    pub fn written(&self) -> &Written {
        &self.written
    }

    /// The same, when it writes no more.
    pub fn into_written(self) -> Written {
        self.written
    }

    /// Also says which axes and fibres the surface has, and whose surface wears.
    pub fn on_surface(mut self, surface: Surface) -> Self {
        self.surface = surface;
        self
    }

    fn mesh(&self) -> &FrameMesh {
        self.mesh.get_or_init(|| FrameMesh::new(self.frame))
    }

    /// Whether fretting loops are asked for.
    pub fn wants_loops(&self) -> bool {
        self.wanted.contains(&FieldKind::Loops)
    }

    /// Whether it writes anything.
    pub fn writes(&self) -> bool {
        !self.wanted.is_empty()
    }

    /// Writes the fields of the next increment.
    ///
    /// # Errors
    /// Resources, if a file cannot be written; numerical, if a field is not finite or cannot be recovered.
    pub fn increment(
        &mut self,
        output: &mut OutputDir,
        record: &IncrementRecord,
        (state, inside): (&FrameState, Vec<Inside>),
    ) -> Result<()> {
        if !self.writes_at(record) {
            return Ok(());
        }
        self.written.increments += 1;
        if self.wanted.contains(&FieldKind::Vtu) {
            let grid = frame_grid(self.frame, (self.mesh(), &self.surface), state)?;
            self.write(output, "frame", &grid)?;
        }
        for body in self.bodies.clone() {
            let meshed = matches!(body.shape, BodyShape::Mesh { .. });
            if self.wanted.contains(&FieldKind::Vtu) || (meshed && FieldKind::need_stress(&self.wanted)) {
                self.body(output, &body, (record, state))
                    .context(|| format!("fields of {}", body.side.key()))?;
            }
        }
        for (request, states) in self.inside.clone().iter().zip(&inside) {
            self.points_inside(output, request, states)
                .context(|| format!("output.inside, \"{}\"", request.name))?;
        }
        // Last, since what comes before may be broken off.
        if self.wanted.contains(&FieldKind::Svg) {
            self.written.pictures.keep(self.frame.n_cells(), record, state);
        }
        Ok(())
    }

    /// What was written before an entry, for [`FieldWriter::back_to`].
    pub fn mark(&self) -> Mark {
        Mark { increments: self.written.increments, peaks: self.written.peaks.len() }
    }

    /// Forgets the entry after `mark`, which was broken off.
    pub fn back_to(&mut self, mark: Mark) {
        let Written { increments, collections, pictures: _, peaks } = &mut self.written;
        *increments = mark.increments;
        peaks.truncate(mark.peaks);
        collections.values_mut().for_each(|files| files.retain(|(time, _)| *time <= mark.increments as f64));
        collections.retain(|_, files| !files.is_empty());
    }

    /// Displacement and stress at the points inside that are asked for.
    ///
    /// # Errors
    /// If they cannot be had, or a stop is wished.
    pub fn inside(&self, state: &FrameState) -> Result<Vec<Inside>> {
        let of = |request: &InsideRequest| {
            let body = self.bodies.iter().find(|body| body.side == request.side);
            let states = body.map(|body| body.body.inside(self.frame, &state.tractions, &request.points()));
            states.transpose().map(Option::flatten).context(|| format!("output.inside, \"{}\"", request.name))
        };
        self.inside.iter().map(of).collect()
    }

    /// Writes displacement and stress at points inside a body.
    fn points_inside(
        &mut self,
        output: &mut OutputDir,
        request: &InsideRequest,
        states: &Inside,
    ) -> Result<()> {
        // Other bodies in the place of the scene's own, as for comparisons, may have none.
        let Some(states) = states else { return Ok(()) };
        let series = request.series();
        write_text(output, &format!("{series}_{:04}.csv", self.written.increments), &request.csv(states)?)?;
        if request.across.is_some() {
            self.write(output, &series, &request.grid(states))?;
        }
        Ok(())
    }

    /// Recovers what is asked for of a body, writes it and keeps its peaks.
    fn body(
        &mut self,
        output: &mut OutputDir,
        body: &BodyOutput<'a>,
        (record, state): (&IncrementRecord, &FrameState),
    ) -> Result<()> {
        let (name, wanted) = (body.side.key(), self.wanted.clone());
        let tractions = by_cell(&state.tractions, self.frame.n_cells(), "traction")?;
        let mut field = body.body.recover(&state.tractions)?;
        if FieldKind::need_stress(&wanted) {
            field.stress = body.body.recover_stress(
                &state.tractions,
                &field.displacement,
                FieldKind::estimate(&wanted),
            )?;
        }
        if let Some(peaks) = body.peaks(self.frame, &field, &tractions) {
            let (step, increment) = (record.name.clone(), record.increment);
            self.written.peaks.push(BodyRecord { body: name.into(), name: step, increment, peaks });
        }
        let meshed = matches!(body.shape, BodyShape::Mesh { .. });
        if wanted.contains(&FieldKind::Vtu) || (meshed && wanted.contains(&FieldKind::Stress)) {
            let grid = surface_grid(body, (self.frame, self.mesh()), &field, &tractions)?;
            self.write(output, name, &grid)?;
        }
        if let BodyShape::Mesh { mesh, .. } = body.shape
            && wanted.contains(&FieldKind::Volume)
            && mesh.volume_cells().next().is_some()
        {
            self.write(output, &format!("{name}_volume"), &volume_grid(mesh, &field)?)?;
        }
        Ok(())
    }

    fn write(&mut self, output: &mut OutputDir, series: &str, grid: &UnstructuredGrid) -> Result<()> {
        let increments = self.written.increments;
        let file = format!("{series}_{increments:04}.vtu");
        output.write(&file, |out| grid.write(out))?;
        let files = self.written.collections.entry(series.to_owned()).or_default();
        files.push((increments as f64, file));
        Ok(())
    }

    /// Writes the collections over the increments, whose time is the number of the entry in `summary.steps`, and
    /// the pictures; hands the peaks of the bodies to the summary.
    ///
    /// # Errors
    /// Resources, if a file cannot be written.
    pub fn finish(self, output: &mut OutputDir, summary: &mut Summary) -> Result<()> {
        let Written { collections, pictures, peaks, .. } = self.written;
        summary.bodies = peaks;
        for (series, files) in collections {
            write_text(output, &format!("{series}.pvd"), &collection(&files))?;
        }
        if !summary.loops.is_empty() {
            let loops: Vec<Loop> = summary.loops.iter().map(Loop::of).collect();
            write_text(output, "loops.svg", &loops_svg(&loops, &summary.units))?;
            write_text(output, "loops.csv", &loops_csv(&summary.loops)?)?;
        }
        pictures.write((self.frame, &self.surface), output, summary)
    }
}

fn write_text(output: &mut OutputDir, name: &str, text: &str) -> Result<()> {
    output.write(name, |out| out.write_all(text.as_bytes()).map_err(|e| write_failure(&e)))
}
