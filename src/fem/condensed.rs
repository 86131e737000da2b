//! A body condensed to its contact nodes: F_cc = (K⁻¹)_cc from the trailing block of the factor.
//!
//! With the contact dofs ordered last, K = L Lᵀ gives K_cc - K_ci K_ii⁻¹ K_ic = L_cc L_ccᵀ, the Schur complement, without
//! any back-substitution; its inverse is the flexibility of the contact nodes. Where L does not fit into the memory, the
//! columns of F_cc are solved for by conjugate gradients.

mod solve;

use std::sync::OnceLock;

use super::analysis::{SymbolicAnalysis, flexibility_bytes};
use super::condensation_method::CondensationMethod;
use super::flexibility_cache::{CacheKey, CacheLookup, FlexibilityCache, FlexibilityEntry};
use super::model::FeModel;
use crate::error::Result;
use crate::linalg::cholesky::{CholeskyFactor, SymmetricSolver};
use crate::linalg::dense::SymmetricDense;
use crate::linalg::memory::MemoryLimit;
use crate::linalg::two_level::TwoLevelSolver;

use self::solve::solve_in_place;

/// What condensing a body may use.
#[derive(Debug, Clone, Copy)]
pub struct CondensationResources<'a> {
    /// Where flexibilities are kept between runs, if they are.
    pub cache: Option<&'a FlexibilityCache>,
    /// What is kept there.
    pub cache_contents: CacheContents,
    /// Memory that may be taken.
    pub memory: MemoryLimit,
}

impl Default for CondensationResources<'_> {
    /// No cache, the memory that the machine has now.
    fn default() -> Self {
        Self { cache: None, cache_contents: CacheContents::Flexibility, memory: MemoryLimit::of_machine() }
    }
}

/// What a cache keeps of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CacheContents {
    /// The flexibility of its contact nodes.
    Flexibility,
    /// That, and the factor that its fields are recovered with.
    FlexibilityAndFactor,
}

/// Where a flexibility came from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlexibilityOrigin {
    /// How it was computed, in this run or in the one that put it into the cache.
    pub method: CondensationMethod,
    /// Iterations of conjugate gradients in this run; 0 where there were none.
    pub iterations: usize,
    /// Whether it was read from the cache.
    pub cached: bool,
    /// What the user should know of the cache: a damaged entry, or one that could not be written.
    pub cache_warning: Option<String>,
}

/// A body with the flexibility of its contact nodes; what solves its systems is made when something else needs it.
pub struct CondensedBody {
    model: FeModel,
    contact_nodes: Vec<usize>,
    solver: OnceLock<Box<dyn SymmetricSolver>>,
    /// Where the factor is kept, if it is.
    factor_cache: Option<(FlexibilityCache, CacheKey)>,
    factor_was_cached: bool,
    resident_bytes: usize,
    residual: f64,
    origin: FlexibilityOrigin,
    flexibility: SymmetricDense,
    contact_free_displacement: Vec<[f64; 3]>,
}

/// A flexibility of the free contact dofs and how it was come by.
struct CondensationResult {
    contact_nodes: Vec<usize>,
    contact_flexibility: SymmetricDense,
    solver: OnceLock<Box<dyn SymmetricSolver>>,
    solver_bytes: usize,
    residual: f64,
    origin: FlexibilityOrigin,
}

impl CondensedBody {
    pub(super) fn new(model: FeModel, analysis: SymbolicAnalysis, memory: MemoryLimit) -> Result<Self> {
        let method = analysis.choose_method(&model, &memory)?;
        let condensed = compute(&model, analysis, method, None)?;
        Self::build(model, condensed, None)
    }

    /// The flexibility from the cache, or computed and put there.
    pub(super) fn cached(
        model: FeModel,
        contact_nodes: &[usize],
        cache: &FlexibilityCache,
        (memory, keep): (MemoryLimit, CacheContents),
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
                        "the flexibility of {} in the cache was damaged ({how}); it was computed anew",
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
            let mut rhs = body.model.load_vector();
            solve_in_place(&body.model, body.solver()?, &mut rhs)?;
            body.contact_free_displacement = body.model.expand(&rhs);
        }
        Ok(body)
    }

    /// What solves the systems, made now if it was not needed before.
    fn solver(&self) -> Result<&dyn SymmetricSolver> {
        if let Some(solver) = self.solver.get() {
            return Ok(solver.as_ref());
        }
        let solver: Box<dyn SymmetricSolver> = match self.origin.method {
            CondensationMethod::Factorisation => Box::new(self.factor()?),
            CondensationMethod::ConjugateGradients(_) => Box::new(iterative(&self.model)?),
        };
        // A second thread may have been faster; both are equal.
        Ok(self.solver.get_or_init(|| solver).as_ref())
    }

    /// The factor, from the cache where it has it; else it is put there.
    fn factor(&self) -> Result<CholeskyFactor> {
        let analysis = self.model.analyse(&self.contact_nodes)?;
        let Some((cache, key)) = &self.factor_cache else { return analysis.factorise(&self.model) };
        if let Some(values) = cache.read_factor(key, analysis.n_values())?
            && let Some(factor) = analysis.restore(&self.model, values)?
        {
            return Ok(factor);
        }
        let factor = self.model.analyse(&self.contact_nodes)?.factorise(&self.model)?;
        // A cache that cannot be written costs the next run time and nothing else.
        let _ = cache.write_factor(key, factor.values());
        Ok(factor)
    }

    /// Whether the cache was expected to have the factor when the body was made, so that solving takes no factorisation.
    pub fn factor_was_cached(&self) -> bool {
        self.factor_was_cached
    }

    /// Bytes that it keeps: the assembled body, its factor if there is one, the flexibility and its copy in use.
    pub fn resident_bytes(&self) -> usize {
        self.resident_bytes
    }

    /// Where the flexibility came from.
    pub fn origin(&self) -> &FlexibilityOrigin {
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
    pub fn contact_free_displacement(&self) -> &[[f64; 3]] {
        &self.contact_free_displacement
    }

    /// Relative residual of the factorisation's check; of the solved columns, the largest, where there was none.
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

/// By `method`; a factor is put where it is kept.
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

/// The flexibility of the free contact dofs spread over all contact dofs, zero where prescribed.
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
