//! Dense matrix of a Newton step and its factorisation.

use std::collections::BTreeMap;

use faer::Par;
use rayon::prelude::*;

use super::factorised_systems::{Entries, MAX_UNKNOWNS, are_applicable, has_inverse};
use super::patches::PatchFactors;
use super::tangent::{NewtonSystem, Rows};
use super::unknowns::{CellStatus, perpendicular};
use crate::error::Result;
use crate::linalg::dense_lu::DenseLu;
use crate::linalg::dense_matrix::DenseMatrix;

/// Diagonal entry of the matrix for an unknown motion. In a cycle without sticking cells and without drift, the
/// equations do not determine a motion common to all path points. The entry then keeps this motion at its value. For
/// other motions, GMRES corrects the error that the entry causes.
const MOTION_REGULARISATION: f64 = 1e-10;

/// Largest memory of the factors of all patches, bytes. Larger systems keep the diagonal as preconditioner.
const MAX_PATCH_BYTES: usize = 512_000_000;

/// Unknown traction or equation of a cell. A traction is `vector` times the unknown. A row is the scalar product of
/// `vector` and the gap.
struct CellVector {
    /// Index of the active cell.
    active: usize,
    vector: [f64; 3],
    /// Whether this is an equation of the slip, or a tangential traction.
    tangential: bool,
}

impl NewtonSystem<'_, '_> {
    /// Factorises the matrix of the system, unless it is singular or too large, or the operator has no entries.
    pub(super) fn factorise(&mut self) {
        self.factors = self.factors();
    }

    /// Cells in contact, ascending.
    fn cells(&self) -> Vec<usize> {
        let mut cells: Vec<usize> = self.active.iter().map(|active| active.cell).collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// Whether the system is too large to be factorised.
    pub(super) fn is_large(&self) -> bool {
        self.len().max(3 * self.cells().len()) > MAX_UNKNOWNS
    }

    fn factors(&mut self) -> Option<DenseLu> {
        let cells = self.cells();
        let unformed = self.problem.flexibility.unformed_cells();
        let formed = cells.iter().all(|cell| unformed.binary_search(cell).is_err());
        if !formed || self.is_large() {
            return None;
        }
        let known = self.entries.take().filter(|known| cells.iter().all(|&cell| known.place(cell).is_some()));
        *self.entries = known.or_else(|| Entries::new(self.problem.flexibility, cells));
        DenseLu::new(self.matrix(self.entries.as_ref()?).ok()?, Par::rayon(0)).ok()
    }

    /// Factorises the systems of the patches, if the whole system is too large to be factorised and the operator has no
    /// approximate inverse. The steps remain inexact.
    pub(super) fn factorise_patches(&mut self) {
        let wanted = !self.problem.patches.is_empty() && self.is_large();
        if wanted && are_applicable(self.problem) && !has_inverse(self.problem) {
            self.patches = self.patch_factors().unwrap_or_default();
            self.update_border();
        }
    }

    /// Factors of the systems of all patches. `None` if a system is singular, if the operator has no entries, or if
    /// memory does not suffice.
    fn patch_factors(&self) -> Option<Vec<PatchFactors>> {
        let unformed = self.problem.flexibility.unformed_cells();
        let mut patches: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (member, active) in self.active.iter().enumerate() {
            if unformed.binary_search(&active.cell).is_ok() {
                return None;
            }
            patches.entry((active.end, self.problem.patches[active.cell])).or_default().push(member);
        }
        let patches: Vec<Vec<usize>> = patches.into_values().collect();
        let sizes =
            patches.iter().map(|members| members.iter().map(|&k| self.active[k].unknowns().len()).sum());
        if size_of::<f64>() * sizes.map(|n: usize| n * n).sum::<usize>() > MAX_PATCH_BYTES {
            return None;
        }
        patches.par_iter().map(|members| self.factors_of_patch(members)).collect()
    }

    fn factors_of_patch(&self, members: &[usize]) -> Option<PatchFactors> {
        let active = || members.iter().map(|&member| &self.active[member]);
        let entries = Entries::new(self.problem.flexibility, active().map(|active| active.cell).collect())?;
        let factors = DenseLu::new(self.matrix_between(members, &entries, 0).ok()?, Par::Seq).ok()?;
        Some(PatchFactors { unknowns: active().flat_map(|active| active.unknowns()).collect(), factors })
    }

    /// Matrix of the system from the flexibility between the cells.
    fn matrix(&self, entries: &Entries) -> Result<DenseMatrix> {
        let members: Vec<usize> = (0..self.active.len()).collect();
        let mut matrix = self.matrix_between(&members, entries, self.free.len())?;
        for (k, (gaps, works)) in self.border_vectors(Rows::All).into_iter().enumerate() {
            let column = matrix.column_mut(self.tractions + k);
            column[..self.tractions].copy_from_slice(&gaps);
            column[self.tractions + k] = MOTION_REGULARISATION;
            for (j, work) in works.into_iter().enumerate() {
                matrix.column_mut(j)[self.tractions + k] = work;
            }
        }
        Ok(matrix)
    }

    /// Matrix of the unknown tractions of the active cells `members`, with `border` further rows and columns of zeros.
    pub(super) fn matrix_between(
        &self,
        members: &[usize],
        entries: &Entries,
        border: usize,
    ) -> Result<DenseMatrix> {
        let place =
            |member: usize| entries.place(self.active[member].cell).expect("entries of all cells in contact");
        let (columns, rows) = (self.cell_vectors(members, false), self.cell_vectors(members, true));
        let row_places: Vec<usize> = rows.iter().map(|row| place(row.active)).collect();
        let (n, m) = (columns.len() + border, entries.cells.len());
        let mut matrix = DenseMatrix::zeros(n, n)?;
        let parts = matrix.values_mut().par_chunks_exact_mut(n.max(1));
        parts.zip(&columns).for_each_init(
            || vec![0.0; 3 * m],
            |gap, (values, column)| {
                entries.matrix.gap_of(place(column.active), column.vector, gap);
                for ((value, row), &i) in values.iter_mut().zip(&rows).zip(&row_places) {
                    let factor = self.coupling(row, column);
                    if factor != 0.0 {
                        let [x, y, z] = row.vector;
                        *value = factor * (x * gap[i] + y * gap[m + i] + z * gap[2 * m + i]);
                    }
                    *value += self.wear_term(row, column);
                }
            },
        );
        let mut first = 0;
        for active in members.iter().map(|&member| &self.active[member]) {
            if let CellStatus::Slip { beta_ratio, .. } = active.state {
                matrix.column_mut(first)[first] += beta_ratio;
            }
            for (i, j, factor) in self.fixed_entries(active) {
                matrix.column_mut(first + j)[first + i] += factor;
            }
            first += active.unknowns().len();
        }
        Ok(matrix)
    }

    /// Vectors of the unknown tractions of the active cells `members`, or with `rows` the vectors of their equations.
    fn cell_vectors(&self, members: &[usize], rows: bool) -> Vec<CellVector> {
        let hat = self.hat;
        let tangential = |e: [f64; 2]| {
            let q = hat.map_or([0.0; 2], |hat| hat.physical_traction(e));
            [q[0], q[1], 0.0]
        };
        let mut vectors = Vec::with_capacity(3 * members.len());
        for (active, cell) in members.iter().map(|&member| (member, &self.active[member])) {
            let scale = |c: &[f64], v: [f64; 3]| if rows { v.map(|x| c[cell.cell] * x) } else { v };
            let mut push = |vector: [f64; 3], tangential: bool| {
                let c = if tangential {
                    &self.problem.scales.c_tangential
                } else {
                    &self.problem.scales.c_normal
                };
                vectors.push(CellVector { active, vector: scale(c, vector), tangential });
            };
            let mut pressure = [0.0, 0.0, 1.0];
            match cell.state {
                CellStatus::PressureOnly | CellStatus::PrescribedSlip { .. } => {}
                CellStatus::Stick => {
                    push(tangential([1.0, 0.0]), true);
                    push(tangential([0.0, 1.0]), true);
                }
                CellStatus::Slip { direction, .. } => {
                    push(tangential(perpendicular(direction)), true);
                }
            }
            if let (false, CellStatus::Slip { direction, .. } | CellStatus::PrescribedSlip { direction }) =
                (rows, cell.state)
            {
                pressure[..2].copy_from_slice(&tangential(direction)[..2]);
            }
            push(pressure, false);
        }
        vectors
    }

    /// Factor on the gap in `row` that a unit of the traction `column` causes.
    fn coupling(&self, row: &CellVector, column: &CellVector) -> f64 {
        let (to, from) = (&self.active[row.active], self.active[column.active].end);
        match row.tangential {
            true => self.slip_factor(to, from),
            false if to.end == from => 1.0,
            false => 0.0,
        }
    }

    /// Implicit wear in `row` per unit of the pressure `column`. Zero if they belong to different cells.
    fn wear_term(&self, row: &CellVector, column: &CellVector) -> f64 {
        let (to, from) = (&self.active[row.active], &self.active[column.active]);
        if row.tangential || column.tangential || to.cell != from.cell || self.problem.wear.is_none() {
            return 0.0;
        }
        let wear = self.change.wear_per_pressure[from.end * self.problem.n() + from.cell];
        row.vector[2] * self.problem.implicit_passes * wear
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{DMatrix, DVector, Matrix3};

    use super::super::tangent::{LinearModel, Workspace};
    use super::*;
    use crate::contact::friction_scaling::FrictionScaling;
    use crate::contact::{
        ContactScales, ContactState, Increment, NormalControl, PathPoint, Pressures, SlipReference,
        TangentialControl,
    };
    use crate::flexibility::Flexibility;
    use crate::flexibility::cell_matrix::CellMatrix;
    use crate::flexibility::per_cell::PerCell;
    use crate::laws::friction::FrictionEllipse;
    use crate::laws::wear::SpecificWearRate;
    use crate::linalg::gmres::{Gmres, KrylovOptions, LinearSystem};
    use crate::omitted::AllowedOmissions;

    /// Full matrix between cells of equal areas, `[3 N, 3 N]`.
    struct Dense(DMatrix<f64>);

    impl Flexibility for Dense {
        fn n_cells(&self) -> usize {
            self.0.nrows() / 3
        }

        fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
            gap.copy_from_slice((&self.0 * DVector::from_column_slice(tractions)).as_slice());
        }

        fn apply_normal(&self, _: &[f64], _: &mut [f64]) {
            unreachable!("there is friction");
        }

        fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
            let n = self.n_cells();
            (0..n).map(|i| Matrix3::from_fn(|a, b| self.0[(a * n + i, b * n + i)])).collect()
        }

        fn is_condensed(&self) -> bool {
            true
        }

        fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) -> bool {
            let n = self.n_cells();
            let block =
                |i: usize, k: usize| Matrix3::from_fn(|a, b| self.0[(a * n + cells[i], b * n + cells[k])]);
            matrix.add_columns(|k| move |i| block(i, k));
            true
        }
    }

    fn wave(k: usize) -> f64 {
        (1.7 * k as f64).sin()
    }

    /// Flexibility S = B Bᵀ + I of `n` cells. Supports fix the cell 1 along y.
    fn flexibility(n: usize) -> Dense {
        let factor = DMatrix::from_fn(3 * n, 3 * n, |i, j| if i == n + 1 { 0.0 } else { wave(i + 7 * j) });
        let mut matrix = &factor * factor.transpose() + DMatrix::identity(3 * n, 3 * n);
        matrix[(n + 1, n + 1)] = 0.0;
        Dense(matrix)
    }

    /// Scaled tractions of four path points. Their directions differ slightly. The last cell is open, and three cells
    /// reach the friction limit.
    fn tractions(n: usize) -> Vec<f64> {
        let mut scaled = vec![0.0; 12 * n];
        for (end, planes) in scaled.chunks_exact_mut(3 * n).enumerate() {
            for i in 0..n - 1 {
                let p = 1.0 + 0.5 * wave(i);
                let share = if [0, 3, 4].contains(&i) { 1.0 } else { 0.3 };
                let (sin, cos) = (i as f64 + 1e-3 * end as f64).sin_cos();
                (planes[i], planes[n + i], planes[2 * n + i]) = (share * p * cos, share * p * sin, p);
            }
        }
        scaled
    }

    /// Initial gap at which the cells with pressure just touch.
    fn closing_gap(operator: &Dense, ellipse: &FrictionEllipse, scaled: &[f64]) -> Vec<f64> {
        let n = operator.n_cells();
        let hat = FrictionScaling::new(ellipse);
        let mut physical = scaled.to_vec();
        for i in 0..n {
            let q = hat.physical_traction([scaled[i], scaled[n + i]]);
            (physical[i], physical[n + i]) = (q[0], q[1]);
        }
        let mut gap = vec![0.0; 3 * n];
        operator.apply(&physical, &mut gap);
        gap.iter_mut().for_each(|gap| *gap = -*gap);
        gap[3 * n - 1] += 1.0;
        gap
    }

    /// A cycle of three path points, the point `free` with unknown motions, and a point with a prescribed slip.
    fn path_points(n: usize, free: usize, origin: Option<[f64; 2]>) -> Vec<PathPoint> {
        let reference = SlipReference::PreviousPoint {
            stick_mask: (0..n).map(|i| i == 2).collect(),
            stick_gap: vec![0.0; 2 * n],
            origin,
        };
        let point = |normal: NormalControl, tangential: TangentialControl| PathPoint {
            normal,
            tangential,
            balance: None,
            reference: reference.clone(),
            load_phase: 0.0,
        };
        let (shift, force) = (TangentialControl::Shift, TangentialControl::Force([0.1, 0.2]));
        let sliding = PathPoint {
            reference: SlipReference::Prescribed((0..2 * n).map(wave).collect()),
            ..point(NormalControl::Approach, shift)
        };
        let mut points = vec![point(NormalControl::Approach, shift); 3];
        points[free] = point(NormalControl::Force(2.0), force);
        points.push(sliding);
        points
    }

    /// Truth: the columns of the matrix are the products of the system with unit vectors. The path points of a cycle
    /// have implicit wear, and cells that are open, stick, slip or stick through the whole cycle. One path point has
    /// unknown motions, and another point has a prescribed slip. With unknown motions at the first point, the body may
    /// drift from cycle to cycle. Tolerance 1e-12: rounding of entries up to 100.
    #[test]
    fn columns_are_products() {
        check_columns(path_points(6, 1, None));
        check_columns(path_points(6, 0, Some([0.0; 2])));
    }

    fn check_columns(path_points: Vec<PathPoint>) {
        let n = 6;
        let operator = flexibility(n);
        let ellipse = FrictionEllipse { mu: [0.3, 0.5], angle: 0.4 };
        let scaled = tractions(n);
        let initial_gap = closing_gap(&operator, &ellipse, &scaled[..3 * n]);
        let (areas, wear_depth) = (vec![0.5; n], vec![0.0; n]);
        let problem = Increment {
            flexibility: &operator,
            areas: &areas,
            initial_gap: &initial_gap,
            cyclic_gap: None,
            rigid_axes: None,
            mode_gaps: &[],
            friction: Some(ellipse),
            wear: Some(SpecificWearRate { i: [1e-3; 2], angle: 0.0 }),
            wear_path_factors: None,
            scales: Arc::new(ContactScales::new(&operator, Some(&ellipse))),
            patches: &[],
            wear_depth: &wear_depth,
            implicit_passes: 50.0,
            pressures: Pressures::Unknown,
            skip: AllowedOmissions::NONE,
            path_points,
        };
        let mut it = ContactState::new(n, vec![[0.0; 3]; 4]);
        it.scaled = scaled;
        problem.evaluate(&mut it);
        let model = LinearModel { flexibility: &operator, zeros: vec![0.0; 3 * n] };
        let mut workspace = Workspace::new(&problem);
        let mut system = NewtonSystem::new(&problem, &it, &model, &mut workspace);
        let states = |wanted: fn(&CellStatus) -> bool| {
            system.active.iter().filter(|active| wanted(&active.state)).count()
        };
        assert!(states(|state| matches!(state, CellStatus::Stick)) > 1);
        assert!(states(|state| matches!(state, CellStatus::Slip { .. })) > 1);
        assert!(states(|state| matches!(state, CellStatus::PrescribedSlip { .. })) > 1);
        assert!(system.active.len() < 4 * n, "no open cell");
        let entries = Entries::new(&operator, (0..n).collect()).expect("entries");
        let matrix = system.matrix(&entries).expect("memory");
        for j in 0..system.len() {
            let (mut unit, mut column) = (vec![0.0; system.len()], vec![0.0; system.len()]);
            unit[j] = 1.0;
            system.apply(&unit, &mut column);
            if j >= system.tractions {
                column[j] += MOTION_REGULARISATION;
            }
            let defect = column.iter().zip(matrix.column(j)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(defect < 1e-12, "column {j}: {defect:e}");
        }
        system.factorise();
        assert!(system.is_factorised(), "a direction without compliance makes the matrix singular");
    }

    /// Number of operator products of GMRES for sticking cells of unit area on a square grid, whose flexibility decays
    /// with the distance. `factorise` selects the factors of `patches` as preconditioner.
    fn patch_products(side: usize, patches: &[usize], factorise: bool) -> usize {
        let n = side * side;
        let decay = |i: usize, k: usize| {
            let [dx, dy] = [(i % side, k % side), (i / side, k / side)].map(|(a, b)| a as f64 - b as f64);
            (-0.25 * dx.hypot(dy)).exp()
        };
        let operator = Dense(DMatrix::from_fn(3 * n, 3 * n, |i, k| match i / n == k / n {
            true => decay(i % n, k % n),
            false => 0.0,
        }));
        let ellipse = FrictionEllipse { mu: [0.3; 2], angle: 0.0 };
        let (areas, worn, gap) = (vec![1.0; n], vec![0.0; n], vec![0.0; 3 * n]);
        let point = PathPoint {
            normal: NormalControl::Approach,
            tangential: TangentialControl::Shift,
            balance: None,
            reference: SlipReference::Previous { gap: vec![0.0; 2 * n], pressures: vec![0.0; n] },
            load_phase: 0.0,
        };
        let problem = Increment {
            flexibility: &operator,
            areas: &areas,
            initial_gap: &gap,
            cyclic_gap: None,
            rigid_axes: None,
            mode_gaps: &[],
            friction: Some(ellipse),
            wear: None,
            wear_path_factors: None,
            scales: Arc::new(ContactScales::new(&operator, Some(&ellipse))),
            patches,
            wear_depth: &worn,
            implicit_passes: 0.0,
            pressures: Pressures::Unknown,
            skip: AllowedOmissions::NONE,
            path_points: vec![point],
        };
        let mut it = ContactState::new(n, vec![[0.0; 3]]);
        it.scaled[2 * n..].fill(1.0);
        it.rigid_motion[0][2] = -1e3;
        problem.evaluate(&mut it);
        let model = LinearModel { flexibility: &operator, zeros: vec![0.0; 3 * n] };
        let mut workspace = Workspace::new(&problem);
        let mut system = NewtonSystem::new(&problem, &it, &model, &mut workspace);
        assert_eq!(system.len(), 3 * n, "all cells stick");
        if factorise {
            system.patches = system.patch_factors().expect("regular systems");
        }
        let rhs: Vec<f64> = (0..3 * n).map(wave).collect();
        let options = KrylovOptions { tolerance: 1e-8, max_products: 200, restart: 200 };
        let mut x = vec![0.0; 3 * n];
        let report = Gmres::default().solve(&mut system, &rhs, &mut x, 1, options).expect("memory")[0];
        assert!(report.residual <= 1e-8);
        report.n_products
    }

    /// Truth: the factors of a patch that contains all cells are the factors of the whole system, so that GMRES needs
    /// one product. Four patches leave only the coupling between them. They need at most three quarters of the products
    /// that the local compliances need.
    #[test]
    fn patches_reduce_the_products_of_gmres() {
        let side = 12;
        let quadrants: Vec<usize> = (0..side * side).map(|i| i % side / 6 + 2 * (i / side / 6)).collect();
        let diagonal = patch_products(side, &quadrants, false);
        let four = patch_products(side, &quadrants, true);
        let one = patch_products(side, &vec![0; side * side], true);
        assert!(one == 1 && 4 * four <= 3 * diagonal, "{one} {four} {diagonal}");
    }
}
