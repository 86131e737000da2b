//! A finite body whose contact is that of a half-space, corrected by finite elements.

use std::sync::Arc;

use super::boundary::Forces;
use super::correction::Correction;
use super::far_field::FarField;
use super::indicators::{Indicators, MOST_TAIL};
use super::operator::corrected;
use super::site::Site;
use super::sources::Chebyshev;
use crate::bem::half_space::{CrossBlocks, PointForceField, SurfaceGreen};
use crate::body::{BodyEquations, BodyField, ElasticBody};
use crate::error::{Context, Error, Result};
use crate::fem::{FeModel, FeSpec};
use crate::frame::{ContactFrame, FaceMap, Grid, MeshedSurface, Side};
use crate::linalg::memory::MemoryLimit;
use crate::linalg::operator::Flexibility;
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces};

/// Most nodes along a side.
const MOST_NODES: usize = 10;

/// A finite-element body with the near field of a half-space.
pub struct HybridBody {
    side: Side,
    /// In the axes of the frame.
    green: SurfaceGreen,
    far: FarField,
    correction: Correction,
    indicators: Indicators,
    grid: Grid,
    places: Option<Vec<usize>>,
    mesh: Arc<Mesh>,
    n_free: usize,
    faces: Vec<SurfaceFace>,
    heights: Vec<f64>,
    free_gap: Option<Vec<f64>>,
    taken: bool,
}

impl HybridBody {
    /// The body of `spec` with the half-space of `site`, found on the same `frame`.
    ///
    /// # Errors
    /// If the group or the frame do not fit, or the body cannot be assembled or solved.
    pub fn new(
        spec: FeSpec,
        (contact, side): (&str, Side),
        frame: &ContactFrame,
        site: &Site,
        memory: &MemoryLimit,
    ) -> Result<Self> {
        let name = spec.name.clone();
        Self::build(spec, (contact, side), frame, site, memory).context(|| name)
    }

    fn build(
        spec: FeSpec,
        (contact, side): (&str, Side),
        frame: &ContactFrame,
        site: &Site,
        memory: &MemoryLimit,
    ) -> Result<Self> {
        let grid = frame.grid.ok_or_else(|| Error::input("a half-space under a mesh needs a grid frame"))?;
        let mesh = spec.mesh.clone();
        let faces = group_faces(&mesh, contact)?;
        let map = FaceMap::new(frame, &mesh, &faces, side)?;
        let heights = map.heights(frame, &mesh);
        let in_frame = site.stiffness.rotated(&frame.axes.0.transpose());
        let green = SurfaceGreen::new(&in_frame, side)?;
        let model = FeModel::within(spec, memory)?;
        let local = site.stiffness.rotated(&site.patch.axes.0.transpose());
        let field = PointForceField::new(&local)?;
        let own = SurfaceGreen::new(&local, Side::Lower)?;
        let mut m = [0, 1].map(|axis| first_nodes(site, axis));
        let (correction, indicators) = loop {
            let points = points(site, m);
            let forces = Forces { patch: site.patch, stiffness: &local, field: &field, points };
            let correction = Correction::new(&model, &forces, memory)?;
            let direct = correction.direct(&model, &forces)?;
            let indicators = Indicators::new(&correction, &direct, (&site.patch, m), &own)?;
            if indicators.tail <= MOST_TAIL || m.iter().any(|&m| m >= MOST_NODES) {
                break (correction, indicators);
            }
            m = m.map(|m| (m + 2).min(MOST_NODES));
        };
        let far = FarField::new(&correction.matrix, m, &site.patch, side);
        let free_gap = correction.free_displacement.as_ref().map(|free| {
            let nodal: Vec<f64> = map.nodes().iter().flat_map(|&node| free[node]).collect();
            let mut gap = vec![0.0; 3 * map.n_cells()];
            map.apply(&nodal, &mut gap);
            gap.iter_mut().for_each(|g| *g *= side.gap_sign());
            gap
        });
        Ok(Self {
            side,
            green,
            far,
            correction,
            indicators,
            grid,
            places: frame.places.clone(),
            n_free: model.n_free(),
            mesh,
            faces,
            heights,
            free_gap,
            taken: false,
        })
    }

    /// How good its correction is.
    pub fn indicators(&self) -> &Indicators {
        &self.indicators
    }

    /// Its correction.
    pub fn correction(&self) -> &Correction {
        &self.correction
    }

    /// Its correction as the frame sees it.
    pub fn far_field(&self) -> &FarField {
        &self.far
    }

    /// Number of unknowns of its finite elements.
    pub fn n_free(&self) -> usize {
        self.n_free
    }
}

/// Nodes to begin with along an axis: as many as a body of such a distance needs.
fn first_nodes(site: &Site, axis: usize) -> usize {
    let distance = site.distance / site.patch.half_width[axis];
    let nodes = match distance {
        d if d >= 4.0 => 4,
        d if d >= 2.0 => 5,
        d if d >= 1.0 => 6,
        _ => 7,
    };
    if site.isotropic { nodes } else { nodes + 1 }
}

/// The nodes of the patch, those along y one after the other.
fn points(site: &Site, m: [usize; 2]) -> Vec<[f64; 2]> {
    let [x, y] = [0, 1].map(|axis| Chebyshev::new(m[axis], site.patch.half_width[axis]));
    x.nodes().iter().flat_map(|&x| y.nodes().iter().map(move |&y| [x, y])).collect()
}

impl ElasticBody for HybridBody {
    fn describe(&self) -> String {
        format!("half-space with the far field of finite elements, {} unknowns", self.n_free)
    }

    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::Hybrid(self)
    }

    fn near_field(&self) -> Option<&SurfaceGreen> {
        Some(&self.green)
    }

    fn take_flexibility(&mut self, cross: CrossBlocks) -> Result<Option<Box<dyn Flexibility>>> {
        if std::mem::replace(&mut self.taken, true) {
            return Err(Error::numerical("the flexibility of a body was taken twice"));
        }
        let cells = (&self.grid, self.places.as_deref());
        Ok(Some(corrected(&self.green, vec![self.far.clone()], cells, cross)?))
    }

    fn free_gap(&self) -> Option<&[f64]> {
        self.free_gap.as_deref()
    }

    fn surface(&self) -> Option<MeshedSurface<'_>> {
        Some(MeshedSurface {
            mesh: &self.mesh,
            faces: &self.faces,
            side: self.side,
            heights: self.heights.clone(),
        })
    }

    fn recover(&self, _tractions: &[f64]) -> Result<BodyField> {
        Err(Error::numerical("not yet"))
    }
}
