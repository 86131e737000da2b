//! Writes the fields of a run, increment by increment: `.vtu` files and the `.pvd` collections over them.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::body::BodyField;
use crate::error::{Context, Result};
use crate::frame::ContactFrame;
use crate::history::step::FrameState;
use crate::results::body_fields::{BodyOutput, BodyShape, surface_grid, volume_grid};
use crate::results::frame_fields::{FrameMesh, by_cell, frame_grid};
use crate::results::output::{OutputDir, write_failure};
use crate::results::vtu::{UnstructuredGrid, collection};

/// Kinds of fields that a scene may ask for in `output.fields`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FieldKind {
    /// Fields on the contact frame and on the surfaces of the bodies.
    Vtu,
    /// Displacement and stress in the volume of finite-element bodies.
    Volume,
    /// Pressure maps and the course of the resultants, as pictures.
    Svg,
}

/// Writes what is asked for of a frame and its bodies.
pub struct FieldWriter<'a> {
    frame: &'a ContactFrame,
    mesh: FrameMesh,
    bodies: Vec<BodyOutput<'a>>,
    wanted: Vec<FieldKind>,
    increments: usize,
    collections: BTreeMap<String, Vec<(f64, String)>>,
}

impl<'a> FieldWriter<'a> {
    /// A writer of the `wanted` fields of `frame` and `bodies`.
    pub fn new(frame: &'a ContactFrame, bodies: Vec<BodyOutput<'a>>, wanted: &[FieldKind]) -> Self {
        let mesh = FrameMesh::new(frame);
        Self { frame, mesh, bodies, wanted: wanted.to_vec(), increments: 0, collections: BTreeMap::new() }
    }

    /// Writes the fields of the next increment.
    ///
    /// # Errors
    /// Resources, if a file cannot be written; numerical, if a field is not finite or cannot be recovered.
    pub fn increment(&mut self, output: &mut OutputDir, state: &FrameState) -> Result<()> {
        self.increments += 1;
        let vtu = self.wanted.contains(&FieldKind::Vtu);
        let volume = self.wanted.contains(&FieldKind::Volume);
        if vtu {
            let grid = frame_grid(self.frame, &self.mesh, state)?;
            self.write(output, "frame", &grid)?;
        }
        for body in self.bodies.clone() {
            let name = body.side.name();
            let meshed = matches!(body.shape, BodyShape::Mesh { .. });
            if vtu || (volume && meshed) {
                let field = body.body.recover(&state.tractions).context(|| format!("fields of {name}"))?;
                self.body(output, &body, &field, state)?;
            }
        }
        Ok(())
    }

    fn body(
        &mut self,
        output: &mut OutputDir,
        body: &BodyOutput<'a>,
        field: &BodyField,
        state: &FrameState,
    ) -> Result<()> {
        let name = body.side.name();
        if self.wanted.contains(&FieldKind::Vtu) {
            let tractions = by_cell(&state.tractions, self.frame.n_cells(), "traction")?;
            let grid = surface_grid(body, (self.frame, &self.mesh), field, &tractions)
                .context(|| format!("surface of {name}"))?;
            self.write(output, name, &grid)?;
        }
        if let BodyShape::Mesh { mesh, .. } = body.shape
            && self.wanted.contains(&FieldKind::Volume)
        {
            let grid = volume_grid(mesh, field).context(|| format!("volume of {name}"))?;
            self.write(output, &format!("{name}_volume"), &grid)?;
        }
        Ok(())
    }

    fn write(&mut self, output: &mut OutputDir, series: &str, grid: &UnstructuredGrid) -> Result<()> {
        let file = format!("{series}_{:04}.vtu", self.increments);
        output.write(&file, |out| grid.write(out))?;
        let files = self.collections.entry(series.to_owned()).or_default();
        files.push((self.increments as f64, file));
        Ok(())
    }

    /// Writes the collections over the increments; their time is the number of the entry in `summary.steps`.
    ///
    /// # Errors
    /// Resources, if a file cannot be written.
    pub fn finish(self, output: &mut OutputDir) -> Result<()> {
        for (series, files) in self.collections {
            let text = collection(&files);
            output.write(&format!("{series}.pvd"), |out| {
                out.write_all(text.as_bytes()).map_err(|e| write_failure(&e))
            })?;
        }
        Ok(())
    }
}
