//! A body condensed to its contact nodes: F_cc = (K⁻¹)_cc from the trailing block of the factor.
//!
//! With the contact dofs ordered last, K = L Lᵀ gives K_cc - K_ci K_ii⁻¹ K_ic = L_cc L_ccᵀ, the Schur complement, without
//! any back-substitution; its inverse is the flexibility of the contact nodes.

use std::sync::OnceLock;
use std::time::Instant;

use super::cache::{CacheEntry, FlexibilityCache, Lookup};
use super::model::FeModel;
use crate::error::Result;
use crate::linalg::dense::SymmetricDense;
use crate::linalg::factor::{CholeskyFactor, SymbolicFactor, SymmetricFactor};
use crate::linalg::memory::MemoryLimit;

/// What condensing a body may use.
#[derive(Debug, Clone, Copy)]
pub struct Resources<'a> {
    /// Where flexibilities are kept between runs, if they are.
    pub cache: Option<&'a FlexibilityCache>,
    /// Memory that may be taken.
    pub memory: MemoryLimit,
}

impl Default for Resources<'_> {
    /// No cache, the memory that the machine has now.
    fn default() -> Self {
        Self { cache: None, memory: MemoryLimit::of_machine() }
    }
}

/// What factorising a body for some contact nodes will take.
pub struct Analysis {
    contact_nodes: Vec<usize>,
    n_trailing: usize,
    n_free: usize,
    model_bytes: usize,
    symbolic: SymbolicFactor,
}

impl Analysis {
    pub(super) fn new(model: &FeModel, contact_nodes: &[usize], order: Vec<usize>) -> Result<Self> {
        let n_trailing = model.contact_rows(contact_nodes).len();
        Ok(Self {
            contact_nodes: contact_nodes.to_vec(),
            n_trailing,
            n_free: model.n_free(),
            model_bytes: model.memory_bytes(),
            symbolic: SymbolicFactor::new(model.stiffness(), &order, n_trailing)?,
        })
    }

    /// Number of free dofs.
    pub fn n_free(&self) -> usize {
        self.n_free
    }

    /// Number of entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.n_stored()
    }

    /// Floating-point operations of factor and flexibility.
    pub fn flops(&self) -> f64 {
        self.symbolic.flops() + 2.0 / 3.0 * (self.n_trailing as f64).powi(3)
    }

    /// Bytes taken at the peak: the assembled body, the factor, and the larger of the factorisation's workspace and the
    /// three dense matrices of the contact dofs.
    pub fn memory_bytes(&self) -> usize {
        let factor = 8 * self.factor_entries();
        let workspace = self.symbolic.memory_bytes() - factor;
        let rest = workspace.max(24 * self.n_trailing * self.n_trailing);
        self.model_bytes + factor + rest
    }

    /// Bytes that a body condensed so keeps.
    pub fn held_bytes(&self) -> usize {
        self.model_bytes + 8 * self.factor_entries() + flexibility_bytes(self.contact_nodes.len())
    }

    /// Checks that the factorisation fits into what `memory` leaves.
    ///
    /// # Errors
    /// If it does not (kind `Resources`), with the bytes needed and allowed.
    pub fn ensure(&self, memory: &MemoryLimit) -> Result<()> {
        let what = format!(
            "factorising {} unknowns, {} of them under the frame ({} entries),",
            self.n_free,
            self.n_trailing,
            self.factor_entries()
        );
        memory.ensure(self.memory_bytes() as u128, &what, "use a coarser mesh, or a smaller frame")
    }
}

/// Where a flexibility came from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Origin {
    /// Seconds of ordering, factorisation and inverse that an entry of the cache saved; `None` if it was computed.
    pub saved_seconds: Option<f64>,
    /// What the user should know of the cache: a damaged entry, or one that could not be written.
    pub note: Option<String>,
}

/// A body with the flexibility of its contact nodes; the factor is made when something else needs it.
pub struct CondensedBody {
    model: FeModel,
    contact_nodes: Vec<usize>,
    memory: MemoryLimit,
    factor: OnceLock<CholeskyFactor>,
    residual: f64,
    origin: Origin,
    flexibility: SymmetricDense,
    free_displacement: Vec<[f64; 3]>,
}

/// A flexibility and how it was come by.
struct Condensed {
    contact_nodes: Vec<usize>,
    /// Of the free contact dofs.
    trailing: SymmetricDense,
    factor: OnceLock<CholeskyFactor>,
    residual: f64,
    origin: Origin,
}

impl CondensedBody {
    pub(super) fn new(model: FeModel, analysis: Analysis, memory: MemoryLimit) -> Result<Self> {
        let contact_nodes = analysis.contact_nodes.clone();
        let factor = factorise(&model, analysis, &memory)?;
        let (trailing, residual) = (factor.trailing_inverse()?, factor.residual());
        let origin = Origin::default();
        let condensed = Condensed { contact_nodes, trailing, factor: factor.into(), residual, origin };
        Self::build(model, condensed, memory)
    }

    /// The flexibility from the cache, or computed and put there.
    pub(super) fn cached(
        model: FeModel,
        contact_nodes: &[usize],
        cache: &FlexibilityCache,
        memory: MemoryLimit,
    ) -> Result<Self> {
        let key = model.cache_key(contact_nodes);
        let n = model.contact_rows(contact_nodes).len();
        let contact_nodes = contact_nodes.to_vec();
        let damage = match cache.read(&key, n)? {
            Lookup::Hit(entry) => {
                let CacheEntry { flexibility: trailing, residual, seconds } = *entry;
                let origin = Origin { saved_seconds: Some(seconds), note: None };
                let factor = OnceLock::new();
                let condensed = Condensed { contact_nodes, trailing, factor, residual, origin };
                return Self::build(model, condensed, memory);
            }
            Lookup::Miss => None,
            Lookup::Damaged(how) => Some(format!(
                "the flexibility of {} in the cache was damaged ({how}); it was computed anew",
                model.name()
            )),
        };
        let start = Instant::now();
        let factor = factorise(&model, model.analyse(&contact_nodes)?, &memory)?;
        let (flexibility, residual) = (factor.trailing_inverse()?, factor.residual());
        let entry = CacheEntry { flexibility, residual, seconds: start.elapsed().as_secs_f64() };
        let note = damage.or(cache.write(&key, &entry).err().map(|error| error.to_string()));
        let origin = Origin { saved_seconds: None, note };
        let trailing = entry.flexibility;
        let condensed = Condensed { contact_nodes, trailing, factor: factor.into(), residual, origin };
        Self::build(model, condensed, memory)
    }

    fn build(model: FeModel, condensed: Condensed, memory: MemoryLimit) -> Result<Self> {
        let Condensed { contact_nodes, trailing, factor, residual, origin } = condensed;
        let flexibility = with_prescribed_rows(&model, &contact_nodes, trailing)?;
        let free_displacement = vec![[0.0; 3]; model.mesh().n_points()];
        let mut body =
            Self { model, contact_nodes, memory, factor, residual, origin, flexibility, free_displacement };
        if let Some(floating) = body.model.floating() {
            let dofs = body.contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
            let rows: Vec<Option<usize>> = dofs.map(|dof| body.model.dofs().row(dof)).collect();
            let mut flexibility = std::mem::take(&mut body.flexibility);
            let factor = body.factor()?;
            floating.centre(&mut flexibility, &rows, |rhs| factor.solve_in_place(rhs, 1))?;
            body.flexibility = flexibility;
        }
        if body.model.is_loaded() {
            let mut rhs = body.model.load_vector();
            solve_in_place(&body.model, body.factor()?, &mut rhs)?;
            body.free_displacement = body.model.expand(&rhs);
        }
        Ok(body)
    }

    /// The factor, made now if it was not needed before.
    fn factor(&self) -> Result<&CholeskyFactor> {
        if let Some(factor) = self.factor.get() {
            return Ok(factor);
        }
        let factor = factorise(&self.model, self.model.analyse(&self.contact_nodes)?, &self.memory)?;
        // A second thread may have been faster; both are equal.
        Ok(self.factor.get_or_init(|| factor))
    }

    /// Bytes that it keeps: the assembled body, its factor if there is one, the flexibility and its copy in use.
    pub fn held_bytes(&self) -> usize {
        let factor = self.factor.get().map_or(0, |factor| 8 * factor.n_stored());
        self.model.memory_bytes() + factor + flexibility_bytes(self.contact_nodes.len())
    }

    /// Where the flexibility came from.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// The model it was condensed from.
    pub fn model(&self) -> &FeModel {
        &self.model
    }

    /// The contact nodes, mesh indices, `[n_c]`.
    pub fn contact_nodes(&self) -> &[usize] {
        &self.contact_nodes
    }

    /// Displacement of the contact nodes by forces on them, global axes, mm/N, `[3 n_c, 3 n_c]`, component c of contact
    /// node i at 3 i + c; rows of prescribed dofs are zero.
    pub fn flexibility(&self) -> &SymmetricDense {
        &self.flexibility
    }

    /// Takes the flexibility out, leaving an empty one: it is the largest dense matrix.
    pub fn take_flexibility(&mut self) -> SymmetricDense {
        std::mem::take(&mut self.flexibility)
    }

    /// Displacement of all mesh nodes by the body's own loads and prescribed displacements, global axes, mm,
    /// `[n_points]`; zero where there are none, and at points on no solid.
    pub fn free_displacement(&self) -> &[[f64; 3]] {
        &self.free_displacement
    }

    /// Relative residual of the factorisation's check.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// Displacement of all mesh nodes, global axes, mm, `[n_points]`, by the body's own loads and the contact forces
    /// `[3 n_c]`, N, global axes, in the order of [`Self::flexibility`]. One back-substitution. A body that floats is
    /// left where its mean motion is zero, without the share of the forces that would move it as a whole.
    ///
    /// # Errors
    /// If memory for the workspace does not suffice.
    ///
    /// # Panics
    /// If there are not 3 n_c forces.
    pub fn solve(&self, contact_forces: &[f64]) -> Result<Vec<[f64; 3]>> {
        assert_eq!(contact_forces.len(), 3 * self.contact_nodes.len(), "three forces per contact node");
        let mut rhs = self.model.load_vector();
        for (force, &node) in contact_forces.chunks_exact(3).zip(&self.contact_nodes) {
            for (component, value) in force.iter().enumerate() {
                if let Some(row) = self.model.free_dof(node, component) {
                    rhs[row] += value;
                }
            }
        }
        solve_in_place(&self.model, self.factor()?, &mut rhs)?;
        Ok(self.model.expand(&rhs))
    }
}

/// Displacement of the free dofs by forces on them, `[n_free]`, in place; of a body that floats by the generalised
/// inverse.
fn solve_in_place(model: &FeModel, factor: &CholeskyFactor, rhs: &mut [f64]) -> Result<()> {
    match model.floating() {
        Some(floating) => floating.solve(rhs, |rhs| factor.solve_in_place(rhs, 1)),
        None => factor.solve_in_place(rhs, 1),
    }
}

/// Bytes of a flexibility of `n_nodes` contact nodes and of the packed copy in use.
pub fn flexibility_bytes(n_nodes: usize) -> usize {
    16 * 9 * n_nodes * n_nodes
}

fn factorise(model: &FeModel, analysis: Analysis, memory: &MemoryLimit) -> Result<CholeskyFactor> {
    analysis.ensure(memory)?;
    analysis.symbolic.factorise(model.stiffness(), |row| model.row_name(row))
}

/// The flexibility of the free contact dofs spread over all contact dofs, zero where prescribed.
fn with_prescribed_rows(
    model: &FeModel,
    contact_nodes: &[usize],
    trailing: SymmetricDense,
) -> Result<SymmetricDense> {
    let dofs = contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
    let free: Vec<usize> = dofs
        .enumerate()
        .filter(|&(_, dof)| model.dofs().row(dof).is_some())
        .map(|(contact_dof, _)| contact_dof)
        .collect();
    let n = 3 * contact_nodes.len();
    if free.len() == n {
        return Ok(trailing);
    }
    let mut full = SymmetricDense::zeros(n)?;
    for (i, &row) in free.iter().enumerate() {
        for (&column, value) in free.iter().zip(trailing.row(i)) {
            full.values_mut()[row * n + column] = *value;
        }
    }
    Ok(full)
}
