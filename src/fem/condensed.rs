//! Static condensation of a body to its contact nodes: the flexibility F_cc = (K⁻¹)_cc of the contact dofs c.
//!
//! The contact dofs c are ordered last, after the other dofs i. With K = L Lᵀ, the Schur complement is K_cc - K_ci K_ii⁻¹ K_ic =
//! L_cc L_ccᵀ, and its inverse is F_cc. If L does not fit into memory, conjugate gradients solve for the columns of F_cc.

mod solve;

use std::sync::OnceLock;

use super::analysis::{SymbolicAnalysis, flexibility_bytes};
use super::condensation_method::CondensationMethod;
use super::flexibility_cache::{CacheKey, CacheLookup, FlexibilityCache, FlexibilityEntry};
use super::model::FeModel;
use crate::error::{Context, Result};
use crate::linalg::cholesky::{CholeskyFactor, SymmetricSolver};
use crate::linalg::dense::SymmetricDense;
use crate::linalg::memory::MemoryLimit;
use crate::linalg::two_level::TwoLevelSolver;

/// Cache and memory that a condensation may use.
#[derive(Debug, Clone, Copy)]
pub struct CondensationResources<'a> {
    /// Cache of flexibilities and factors, if any.
    pub cache: Option<&'a FlexibilityCache>,
    /// What the cache stores.
    pub cache_contents: CacheContents,
    /// Memory limit.
    pub memory: MemoryLimit,
}

impl Default for CondensationResources<'_> {
    fn default() -> Self {
        Self { cache: None, cache_contents: CacheContents::Flexibility, memory: MemoryLimit::of_machine() }
    }
}

/// Results of a condensation that the cache stores.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CacheContents {
    /// Flexibility of the contact nodes. If the body is unconstrained or has own loads ([`FeModel::has_own_loads`]),
    /// also the factor.
    Flexibility,
    /// Flexibility and factor, for the recovery of fields.
    FlexibilityAndFactor,
}

/// How a flexibility was obtained: method, iterations, cache.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlexibilityOrigin {
    /// Method of computation, in this run or in the run that wrote the cache entry.
    pub method: CondensationMethod,
    /// Largest number of conjugate-gradient iterations of a column of the flexibility in this run; 0 without iterative solves.
    pub iterations: usize,
    /// Whether the flexibility was read from the cache.
    pub cached: bool,
    /// Warning about a damaged cache entry or a failed write to the cache.
    pub cache_warning: Option<String>,
}

/// Body with the flexibility of its contact nodes.
pub struct CondensedBody {
    model: FeModel,
    contact_nodes: Vec<usize>,
    solver: OnceLock<Box<dyn SymmetricSolver>>,
    factor_cache: Option<(FlexibilityCache, CacheKey)>,
    factor_was_cached: bool,
    resident_bytes: usize,
    residual: f64,
    origin: FlexibilityOrigin,
    flexibility: SymmetricDense,
    contact_free_displacement: Vec<[f64; 3]>,
}

struct CondensationResult {
    contact_nodes: Vec<usize>,
    contact_flexibility: SymmetricDense,
    solver: OnceLock<Box<dyn SymmetricSolver>>,
    solver_bytes: usize,
    residual: f64,
    origin: FlexibilityOrigin,
}

impl FeModel {
    /// Computes the flexibility of `contact_nodes` (mesh node indices), without a cache and within the default memory limit.
    ///
    /// # Errors
    /// As [`Self::analyse`], or if K is singular, the factorisation fails its check, conjugate gradients do not converge, or memory
    /// does not suffice.
    pub fn condense(self, contact_nodes: &[usize]) -> Result<CondensedBody> {
        self.condense_with(contact_nodes, &CondensationResources::default())
    }

    /// Computes the flexibility as [`Self::condense`] does, within the memory limit and with the cache of `resources`.
    ///
    /// # Errors
    /// See [`Self::condense`]. A failed write to the cache is not an error; [`CondensedBody::origin`] reports it.
    pub fn condense_with(
        self,
        contact_nodes: &[usize],
        resources: &CondensationResources,
    ) -> Result<CondensedBody> {
        self.check_contact_nodes(contact_nodes).context(|| self.name().to_owned())?;
        let CondensationResources { cache, cache_contents, memory } = *resources;
        let name = self.name().to_owned();
        match cache {
            Some(cache) => CondensedBody::cached(self, contact_nodes, cache, memory, cache_contents),
            None => {
                let analysis = self.analyse(contact_nodes)?;
                CondensedBody::new(self, analysis, memory)
            }
        }
        .context(|| name)
    }

    /// Cache key of the flexibility of `contact_nodes` computed by `method`.
    pub fn cache_key(&self, contact_nodes: &[usize], method: CondensationMethod) -> CacheKey {
        CacheKey::new(self.stiffness(), &self.contact_rows(contact_nodes), method.name())
    }

    /// Peak memory of a factorisation, bytes, as stored in the cache; `None` if the cache has no matching entry. Checks only the
    /// header and the size of the entry.
    pub fn cached_factorisation_bytes(
        &self,
        contact_nodes: &[usize],
        method: CondensationMethod,
        cache: &FlexibilityCache,
    ) -> Option<usize> {
        cache.peek_factorisation_bytes(
            &self.cache_key(contact_nodes, method),
            self.contact_rows(contact_nodes).len(),
        )
    }

    /// Whether `cache` has the factor for `contact_nodes`.
    pub fn has_cached_factor(&self, contact_nodes: &[usize], cache: &FlexibilityCache) -> bool {
        cache.has_factor(&self.cache_key(contact_nodes, CondensationMethod::Factorisation))
    }
}

impl CondensedBody {
    pub(super) fn new(model: FeModel, analysis: SymbolicAnalysis, memory: MemoryLimit) -> Result<Self> {
        let method = analysis.choose_method(&model, &memory)?;
        let condensed = compute(&model, analysis, method, None)?;
        Self::build(model, condensed, None)
    }

    pub(super) fn cached(
        model: FeModel,
        contact_nodes: &[usize],
        cache: &FlexibilityCache,
        memory: MemoryLimit,
        keep: CacheContents,
    ) -> Result<Self> {
        let wanted = keep == CacheContents::FlexibilityAndFactor
            || model.has_own_loads()
            || model.generalised_inverse().is_some();
        let n = model.contact_rows(contact_nodes).len();
        let mut damage = None;
        let mut find = |method: CondensationMethod| -> Result<Option<FlexibilityEntry>> {
            match cache.read(&model.cache_key(contact_nodes, method), n)? {
                CacheLookup::Hit(entry) => return Ok(Some(entry)),
                CacheLookup::Miss => {}
                CacheLookup::Damaged(how) => {
                    damage = Some(format!(
                        "the flexibility of {} in the cache was damaged ({how}) and not used",
                        model.name()
                    ));
                }
            }
            Ok(None)
        };
        let key = model.cache_key(contact_nodes, CondensationMethod::Factorisation);
        let kept = wanted.then(|| (cache.clone(), key));
        if let Some(entry) = find(CondensationMethod::Factorisation)?
            && CondensationMethod::choose(&model, n, entry.factorisation_bytes, &memory)?
                == CondensationMethod::Factorisation
        {
            let factor_bytes = entry.factorisation_bytes.saturating_sub(model.resident_bytes());
            let mut condensed = from_cache(contact_nodes, entry, CondensationMethod::Factorisation);
            condensed.solver_bytes = if wanted { factor_bytes } else { 0 };
            return Self::build(model, condensed, kept);
        }
        let analysis = model.analyse(contact_nodes)?;
        let method = analysis.choose_method(&model, &memory)?;
        if method != CondensationMethod::Factorisation
            && let Some(entry) = find(method)?
        {
            let mut condensed = from_cache(contact_nodes, entry, method);
            condensed.origin.cache_warning = damage;
            return Self::build(model, condensed, None);
        }
        let factorisation_bytes = analysis.factorisation_peak_bytes();
        let mut condensed = compute(&model, analysis, method, kept.as_ref())?;
        let entry = FlexibilityEntry {
            flexibility: std::mem::take(&mut condensed.contact_flexibility),
            residual: condensed.residual,
            factorisation_bytes,
        };
        let written = cache.write(&model.cache_key(contact_nodes, method), &entry);
        condensed.origin.cache_warning =
            damage.or(condensed.origin.cache_warning).or(written.err().map(|error| error.to_string()));
        condensed.contact_flexibility = entry.flexibility;
        Self::build(model, condensed, None)
    }

    fn build(
        model: FeModel,
        condensed: CondensationResult,
        factor_cache: Option<(FlexibilityCache, CacheKey)>,
    ) -> Result<Self> {
        let CondensationResult { contact_nodes, contact_flexibility, solver, solver_bytes, residual, origin } =
            condensed;
        let flexibility = expand_to_contact_dofs(&model, &contact_nodes, contact_flexibility)?;
        let factor_was_cached = factor_cache.as_ref().is_some_and(|(cache, key)| cache.has_factor(key));
        let contact_free_displacement = vec![[0.0; 3]; model.mesh().n_points()];
        let resident_bytes = model.resident_bytes() + solver_bytes + flexibility_bytes(contact_nodes.len());
        let mut body = Self {
            model,
            contact_nodes,
            solver,
            factor_cache,
            factor_was_cached,
            resident_bytes,
            residual,
            origin,
            flexibility,
            contact_free_displacement,
        };
        if let Some(floating) = body.model.generalised_inverse() {
            let dofs = body.contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
            let rows: Vec<Option<usize>> = dofs.map(|dof| body.model.dof_map().row(dof)).collect();
            let mut flexibility = std::mem::take(&mut body.flexibility);
            let solver = body.solver()?;
            floating.project_flexibility(&mut flexibility, &rows, |rhs| solver.solve_in_place(rhs, 1))?;
            body.flexibility = flexibility;
        }
        if body.model.has_own_loads() {
            body.contact_free_displacement = body.displacement_of_loads(body.model.loads())?;
        }
        Ok(body)
    }

    fn solver(&self) -> Result<&dyn SymmetricSolver> {
        if let Some(solver) = self.solver.get() {
            return Ok(solver.as_ref());
        }
        let solver: Box<dyn SymmetricSolver> = match self.origin.method {
            CondensationMethod::Factorisation => Box::new(self.factor()?),
            CondensationMethod::ConjugateGradients(_) => Box::new(iterative(&self.model)?),
        };
        // Another thread may have stored an equal solver first.
        Ok(self.solver.get_or_init(|| solver).as_ref())
    }

    fn factor(&self) -> Result<CholeskyFactor> {
        let analysis = self.model.analyse(&self.contact_nodes)?;
        let Some((cache, key)) = &self.factor_cache else { return analysis.factorise(&self.model) };
        if let Some(values) = cache.read_factor(key, analysis.n_values())?
            && let Some(factor) = analysis.restore(&self.model, values)?
        {
            return Ok(factor);
        }
        let factor = self.model.analyse(&self.contact_nodes)?.factorise(&self.model)?;
        // A failed write is ignored. Without this cache entry, a later run factorises again.
        let _ = cache.write_factor(key, factor.values());
        Ok(factor)
    }

    /// Whether the cache had the factor when the body was created.
    pub fn factor_was_cached(&self) -> bool {
        self.factor_was_cached
    }

    /// Memory of the condensed body, bytes.
    pub fn resident_bytes(&self) -> usize {
        self.resident_bytes
    }

    /// Origin of the flexibility.
    pub fn origin(&self) -> &FlexibilityOrigin {
        &self.origin
    }

    /// Model of the condensed body.
    pub fn model(&self) -> &FeModel {
        &self.model
    }

    /// Contact nodes, mesh indices, `[n_c]`.
    pub fn contact_nodes(&self) -> &[usize] {
        &self.contact_nodes
    }

    /// Displacement of the contact nodes due to unit forces on them, global axes, mm/N, `[3 n_c, 3 n_c]`. Component c of contact
    /// node i has index 3 i + c. Rows of prescribed dofs are zero.
    pub fn flexibility(&self) -> &SymmetricDense {
        &self.flexibility
    }

    /// Moves the flexibility out of the body and leaves an empty one.
    pub fn take_flexibility(&mut self) -> SymmetricDense {
        std::mem::take(&mut self.flexibility)
    }

    /// Displacement of all mesh nodes due to the body's own loads and prescribed displacements, global axes, mm, `[n_points]`.
    pub fn contact_free_displacement(&self) -> &[[f64; 3]] {
        &self.contact_free_displacement
    }

    /// Relative residual of the check after a factorisation. With conjugate gradients: largest relative residual over
    /// the solved columns.
    pub fn residual(&self) -> f64 {
        self.residual
    }
}

fn from_cache(
    contact_nodes: &[usize],
    entry: FlexibilityEntry,
    method: CondensationMethod,
) -> CondensationResult {
    CondensationResult {
        contact_nodes: contact_nodes.to_vec(),
        contact_flexibility: entry.flexibility,
        solver: OnceLock::new(),
        solver_bytes: 0,
        residual: entry.residual,
        origin: FlexibilityOrigin { method, cached: true, ..FlexibilityOrigin::default() },
    }
}

pub(super) fn iterative(model: &FeModel) -> Result<TwoLevelSolver> {
    TwoLevelSolver::new(model.stiffness(), &model.unknowns())
}

fn compute(
    model: &FeModel,
    analysis: SymbolicAnalysis,
    method: CondensationMethod,
    kept: Option<&(FlexibilityCache, CacheKey)>,
) -> Result<CondensationResult> {
    let contact_nodes = analysis.contact_nodes().to_vec();
    let mut origin = FlexibilityOrigin { method, ..FlexibilityOrigin::default() };
    let solver_bytes = analysis.solver_bytes(model, method);
    let (solver, contact_flexibility, residual): (Box<dyn SymmetricSolver>, _, _) = match method {
        CondensationMethod::Factorisation => {
            let factor = analysis.factorise(model)?;
            let written = kept.map_or(Ok(()), |(cache, key)| cache.write_factor(key, factor.values()));
            origin.cache_warning = written.err().map(|error| error.to_string());
            let (trailing, residual) = (factor.trailing_inverse()?, factor.residual());
            (Box::new(factor), trailing, residual)
        }
        CondensationMethod::ConjugateGradients(_) => {
            let solver = iterative(model)?;
            let block = solver.inverse_block(&model.contact_rows(&contact_nodes))?;
            origin.iterations = block.convergence.iterations;
            (Box::new(solver), block.values, block.residual)
        }
    };
    Ok(CondensationResult {
        contact_nodes,
        contact_flexibility,
        solver: solver.into(),
        solver_bytes,
        residual,
        origin,
    })
}

/// Inserts zero rows and columns for the prescribed contact dofs.
fn expand_to_contact_dofs(
    model: &FeModel,
    contact_nodes: &[usize],
    trailing: SymmetricDense,
) -> Result<SymmetricDense> {
    let dofs = contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
    let free: Vec<usize> = dofs
        .enumerate()
        .filter(|&(_, dof)| model.dof_map().row(dof).is_some())
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

/// Replaces forces on the free dofs, `[n_free]`, by the resulting displacements.
fn solve_in_place(model: &FeModel, solver: &dyn SymmetricSolver, rhs: &mut [f64]) -> Result<()> {
    match model.generalised_inverse() {
        Some(floating) => floating.solve(rhs, |rhs| solver.solve_in_place(rhs, 1)),
        None => solver.solve_in_place(rhs, 1),
    }
}
