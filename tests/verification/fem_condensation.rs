//! Condensation to the contact nodes: exactness, reciprocity, bitwise reproducibility, memory.

use nalgebra::{DMatrix, DVector};
use orthowear::element::ElementKind::{self, Hex8};
use orthowear::fem::{
    CondensationMethod, CondensationResources, CondensedBody, FeModel, FlexibilityCache, HexFormulation,
    StressRecovery, Support,
};
use orthowear::linalg::memory::MemoryLimit;
use orthowear::linalg::two_level::TwoLevelSolver;

use super::fem_bodies::{ELEMENTS, clamp, isotropic, largest_difference, rotated_orthotropic, spec};
use super::fem_meshes::{block, rough, wavy};
use crate::common::usual_or_finest;

/// A block under pressure, body force and a prescribed displacement, condensed to the nodes of its top.
fn loaded_block(
    kind: ElementKind,
    formulation: HexFormulation,
    cells: [usize; 3],
    map: fn([f64; 3]) -> [f64; 3],
) -> CondensedBody {
    let mesh = block(kind, cells, [1.0; 3], map);
    let top = mesh.group_nodes("z1").unwrap();
    let roller = Support {
        group: "x0".into(),
        components: [true, false, false],
        value: [1e-3, 0.0, 0.0],
        gradient: [[0.0; 3]; 3],
    };
    let base = Support {
        group: "z0".into(),
        components: [false, true, true],
        value: [0.0; 3],
        gradient: [[0.0; 3]; 3],
    };
    let mut spec = spec(mesh, rotated_orthotropic(), formulation, vec![roller, base]);
    spec.pressures = vec![("y1".into(), 30.0)];
    spec.body_force = [0.0, 1.0, -2.0];
    FeModel::new(spec).unwrap().condense(&top).unwrap()
}

fn forces(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 31) as f64 - 0.5
    };
    (0..n).map(|_| 100.0 * next()).collect()
}

fn at_contact(body: &CondensedBody, u: &[[f64; 3]]) -> Vec<f64> {
    body.contact_nodes().iter().flat_map(|&node| u[node]).collect()
}

/// Truth: condensation is exact (Guyan 1965). Under contact forces f, the contact nodes move by F_cc f + u_free in the full
/// solution. u_free is their displacement for f = 0. F_cc is the contact block of the inverse of the assembled stiffness matrix
/// K. Another library computes this inverse from a dense factorisation. The tolerance is 1e-10.
#[test]
fn condensation_is_exact() {
    for (kind, formulation) in ELEMENTS {
        // Meshes are coarse, because the dense inverse dominates the run time.
        let body = loaded_block(
            kind,
            formulation,
            if kind.n_nodes() > 8 { [2; 3] } else { [usual_or_finest(3, 4); 3] },
            rough,
        );
        let model = body.model();
        let n = model.n_free();
        let mut k = DMatrix::zeros(n, n);
        model.stiffness().entries().for_each(|(i, j, v)| k[(i, j)] = v);
        let k = k.cholesky().unwrap();
        let inverse = k.inverse();
        let contact: Vec<Option<usize>> = body
            .contact_nodes()
            .iter()
            .flat_map(|&node| (0..3).map(move |c| (node, c)))
            .map(|(node, c)| model.free_dof(node, c))
            .collect();
        assert!(contact.iter().any(Option::is_none));
        let (flexibility, largest) = (body.flexibility(), inverse.amax());
        for (i, &row) in contact.iter().enumerate() {
            for (j, &column) in contact.iter().enumerate() {
                let dense = row.zip(column).map_or(0.0, |(r, c)| inverse[(r, c)]);
                assert!((flexibility.at(i, j) - dense).abs() < 1e-10 * largest);
                assert_eq!(flexibility.at(i, j).to_bits(), flexibility.at(j, i).to_bits());
            }
        }
        let f = forces(contact.len(), 1);
        let full = body.solve(&f).unwrap();
        let free = at_contact(&body, body.contact_free_displacement());
        let solved = at_contact(&body, &full);
        let scale = solved.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for i in 0..contact.len() {
            let condensed: f64 = free[i] + flexibility.row(i).iter().zip(&f).map(|(a, b)| a * b).sum::<f64>();
            assert!((condensed - solved[i]).abs() < 1e-10 * scale);
        }
        let mut rhs = DVector::from_vec(model.load_vector(model.loads()));
        contact.iter().zip(&f).for_each(|(row, value)| row.iter().for_each(|&row| rhs[row] += value));
        let dense = model.expand(k.solve(&rhs).as_slice(), model.loads());
        assert!(largest_difference(&full, &dense) < 1e-10 * scale);
        assert!(body.residual() < 1e-12);
    }
}

/// Truth: forces a do the same work on the displacements due to forces b as forces b do on the displacements due to a (Betti
/// 1872). The tolerance is 1e-12, relative to the work of a on its own displacements. The strain energy is half the work of the
/// forces (Clapeyron), to 1e-11 (catalogue case `schur-exactness`, docs/verification.md).
#[test]
fn maxwell_betti() {
    for (kind, formulation) in ELEMENTS {
        let mesh = block(kind, [5, 4, 3], [1.0; 3], rough);
        let top = mesh.group_nodes("z1").unwrap();
        let model = FeModel::new(spec(mesh, rotated_orthotropic(), formulation, vec![clamp("z0")])).unwrap();
        let body = model.condense(&top).unwrap();
        let (a, b) = (forces(3 * top.len(), 1), forces(3 * top.len(), 2));
        let (ua, ub) = (body.solve(&a).unwrap(), body.solve(&b).unwrap());
        let work = |f: &[f64], u: &[[f64; 3]]| -> f64 {
            f.iter().zip(at_contact(&body, u)).map(|(f, u)| f * u).sum()
        };
        let (ab, ba, aa) = (work(&a, &ub), work(&b, &ua), work(&a, &ua));
        assert!((ab - ba).abs() < 1e-12 * aa);
        assert!((body.model().strain_energy(&ua).unwrap() / (0.5 * aa) - 1.0).abs() < 1e-11);
        let reactions = body.model().reactions(&ua).unwrap();
        for c in 0..3 {
            let applied: f64 = a.iter().skip(c).step_by(3).sum();
            let sum: f64 = reactions.iter().map(|r| r[c]).sum();
            assert!((sum + applied).abs() < 1e-9);
        }
    }
}

/// Truth: any number of threads gives the same bits.
#[test]
fn same_bits_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let body = loaded_block(Hex8, HexFormulation::Enhanced, [12, 12, 10], wavy);
            let u = body.solve(&forces(3 * body.contact_nodes().len(), 3)).unwrap();
            let recovery = StressRecovery::new(body.model()).unwrap();
            let stress = recovery.stress(body.model(), &u).unwrap();
            let flat: Vec<f64> = u.iter().flatten().chain(stress.iter().flatten()).copied().collect();
            flat.iter().chain(body.flexibility().values()).map(|v| v.to_bits()).collect::<Vec<u64>>()
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
}

/// Truth: the factor and one dense matrix of the contact unknowns must fit in memory. The estimated peak memory therefore exceeds
/// their size, but by less than a factor of ten.
#[test]
fn analysis_foretells_the_memory() {
    let mesh = block(Hex8, [6, 6, 6], [1.0; 3], |x| x);
    let top = mesh.group_nodes("z1").unwrap();
    let model = FeModel::new(spec(mesh, isotropic(), HexFormulation::Enhanced, vec![clamp("z0")])).unwrap();
    let analysis = model.analyse(&top).unwrap();
    assert_eq!(analysis.n_free(), 6 * 49 * 3);
    let least = 8 * analysis.factor_entries() + 8 * (3 * top.len()).pow(2);
    assert!(analysis.factorisation_peak_bytes() > least && analysis.factorisation_peak_bytes() < 10 * least);
    assert!(model.condense(&top).unwrap().residual() < 1e-12);
}

/// Truth: a body from the cache has the same flexibility, solution and free displacement as a factorised body, to the last bit.
#[test]
fn cached_bodies_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let cache = FlexibilityCache::new(folder.path(), 1 << 30);
    let resources = CondensationResources { cache: Some(&cache), ..CondensationResources::default() };
    let mesh = block(Hex8, [5, 4, 4], [1.0; 3], rough);
    let top = mesh.group_nodes("z1").unwrap();
    let body = |loaded: bool| {
        let mut spec = spec(mesh.clone(), rotated_orthotropic(), HexFormulation::Enhanced, vec![clamp("z0")]);
        spec.body_force = [0.0, 0.0, if loaded { -2.0 } else { 0.0 }];
        FeModel::new(spec).unwrap()
    };
    let mut restored = false;
    for loaded in [false, true] {
        let plain = body(loaded).condense(&top).unwrap();
        assert!(!plain.origin().cached);
        for _ in 0..2 {
            let cached = body(loaded).condense_with(&top, &resources).unwrap();
            assert!(cached.flexibility() == plain.flexibility() && cached.residual() == plain.residual());
            assert_eq!(cached.contact_free_displacement(), plain.contact_free_displacement());
            restored |= cached.factor_was_cached();
            let f = forces(3 * top.len(), 5);
            assert_eq!(cached.solve(&f).unwrap(), plain.solve(&f).unwrap());
        }
    }
    assert!(restored, "the factor of the loaded body was kept");
    // The cache holds two entries: the flexibility, which does not depend on loads, and the factor of the loaded body.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    let cached = body(false).condense_with(&top, &resources).unwrap();
    assert!(cached.origin().cached);
}

fn rough_block(cells: usize, held: bool) -> (FeModel, Vec<usize>) {
    let mesh = block(Hex8, [cells; 3], [1.0; 3], wavy);
    let contact = mesh.group_nodes("z1").unwrap().into_iter().step_by(7).take(24).collect();
    let supports = if held { vec![clamp("z0")] } else { vec![] };
    let mut spec = spec(mesh, rotated_orthotropic(), HexFormulation::Enhanced, supports);
    spec.body_force = [1.0, 0.0, if held { -2.0 } else { 0.0 }];
    (FeModel::new(spec).unwrap(), contact)
}

/// Condenses the body of [`rough_block`] by conjugate gradients, because the memory limit is one byte too low for a
/// factorisation.
fn without_factor(cells: usize, held: bool, threads: usize) -> CondensedBody {
    let (model, contact) = rough_block(cells, held);
    let needed = model.analyse(&contact).unwrap().factorisation_peak_bytes();
    let memory = MemoryLimit::of_scene(needed as u64 - 1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        model
            .condense_with(&contact, &CondensationResources { memory, ..CondensationResources::default() })
            .unwrap()
    })
}

/// Truth: the inverse of the stiffness matrix does not depend on the method. The tolerance is 1e-9 of the largest entry, because
/// conjugate gradients solve the columns to an energy error of 1e-11.
#[test]
fn conjugate_gradients_give_what_the_factor_gives() {
    for held in [true, false] {
        let n = usual_or_finest(10, 14);
        let (model, contact) = rough_block(n, held);
        let direct = model.condense(&contact).unwrap();
        assert_eq!(direct.origin().method, CondensationMethod::Factorisation);
        let iterative = without_factor(n, held, 1);
        assert!(matches!(iterative.origin().method, CondensationMethod::ConjugateGradients(_)));
        assert!(iterative.residual() < 1e-9, "{}", iterative.residual());
        let scale = direct.flexibility().values().iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let pairs = direct.flexibility().values().iter().zip(iterative.flexibility().values());
        let worst = pairs.fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(worst < 1e-9 * scale, "held {held}: {:e}", worst / scale);
        let f = forces(3 * contact.len(), 9);
        let [a, b] = [&direct, &iterative].map(|body| body.solve(&f).unwrap());
        let size = a.iter().flatten().fold(0.0f64, |most, v| most.max(v.abs()));
        assert!(largest_difference(&a, &b) < 1e-9 * size, "held {held}");
        if held {
            let three = without_factor(n, held, 3);
            assert!(three.flexibility() == iterative.flexibility() && three.solve(&f).unwrap() == b);
        }
    }
}

/// Truth: with a coarse space of rigid-body motions, the condition number of the preconditioned system is bounded for any mesh
/// (Nicolaides 1987). With twice the cells along each edge the number of iterations grows by less than half.
#[test]
fn iterations_do_not_grow_with_the_mesh() {
    let counts = [6, 12].map(|cells| {
        let (model, contact) = rough_block(cells, true);
        let solver = TwoLevelSolver::new(model.stiffness(), &model.unknowns()).unwrap();
        let rows = &model.contact_rows(&contact)[..8];
        solver.inverse_block(rows).unwrap().convergence.iterations
    });
    assert!(counts[1] < 60 && counts[1] < counts[0] + counts[0] / 2, "{counts:?}");
}
