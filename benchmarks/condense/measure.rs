//! Condenses one block in this process, and measures each stage.

use std::time::Instant;

use orthowear::linalg::cholesky::{SymbolicCholesky, SymmetricSolver};
use orthowear::linalg::two_level::TwoLevelSolver;

use crate::Outcome;
use crate::case::{Case, Ordering};

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Route {
    /// The flexibility follows from the trailing block of the factor.
    Schur,
    /// The flexibility follows from solutions for a unit force on each contact row.
    BackSolve,
}

/// Times of the last call of `lap`: instant, and processor seconds of the process.
struct Watch(Instant, f64);

impl Watch {
    fn lap(&mut self) -> [f64; 2] {
        let (now, cpu) = (Instant::now(), cpu_seconds());
        let lap = [(now - self.0).as_secs_f64(), cpu - self.1];
        (self.0, self.1) = (now, cpu);
        lap
    }
}

fn cpu_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a valid timespec.
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) };
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Condenses a block and prints `key value` lines.
pub fn measure(name: &str, ordering: Ordering, route: Route) -> Outcome<()> {
    let mut watch = Watch(Instant::now(), cpu_seconds());
    let case = Case::new(name)?;
    let assemble = watch.lap();
    let (order, n_contact) = case.order(ordering)?;
    let analyse = watch.lap();
    let matrix = case.model.stiffness();
    let n_trailing = if route == Route::Schur { n_contact } else { 0 };
    let symbolic = SymbolicCholesky::new(matrix, &order, n_trailing)?;
    let symbolic_seconds = watch.lap();
    let (flops, entries, bytes) = (symbolic.flops(), symbolic.n_factor_entries(), symbolic.memory_bytes());
    let factor = symbolic.factorise(matrix, |row| row.to_string())?;
    let factor_seconds = watch.lap();
    let contact = &order[order.len() - n_contact..];
    let trace = match route {
        Route::Schur => {
            let inverse = factor.trailing_inverse()?;
            (0..n_contact).map(|i| inverse.at(i, i)).sum::<f64>()
        }
        Route::BackSolve => back_solves(&factor, contact)?,
    };
    let flexibility = watch.lap();
    let stages = [
        ("assemble", assemble),
        ("order", analyse),
        ("symbolic", symbolic_seconds),
        ("factor", factor_seconds),
        ("flexibility", flexibility),
    ];
    for (stage, [wall, cpu]) in stages {
        println!("{stage}_wall {wall:.4}\n{stage}_cpu {cpu:.4}");
    }
    println!("unknowns {}\ncontact {n_contact}\nentries {entries}\nflops {flops:.6e}", matrix.n());
    println!(
        "estimate_bytes {bytes}\npeak_bytes {}\ntrace {trace:.15e}",
        orthowear::output::peak_memory::peak_bytes()
    );
    println!("residual {:.1e}", factor.residual());
    Ok(())
}

/// Trace of the flexibility of the contact rows, by solutions for batches of unit forces.
fn back_solves(factor: &impl SymmetricSolver, contact: &[usize]) -> Outcome<f64> {
    const BATCH: usize = 64;
    let n = factor.n();
    let mut trace = 0.0;
    for batch in contact.chunks(BATCH) {
        let mut columns = vec![0.0; n * batch.len()];
        batch.iter().enumerate().for_each(|(c, &row)| columns[c * n + row] = 1.0);
        factor.solve_in_place(&mut columns, batch.len())?;
        trace += batch.iter().enumerate().map(|(c, &row)| columns[c * n + row]).sum::<f64>();
    }
    Ok(trace)
}

/// Condenses a block by conjugate gradients instead of a factor, and prints `key value` lines as [`measure`].
pub fn iterate(name: &str) -> Outcome<()> {
    let mut watch = Watch(Instant::now(), cpu_seconds());
    let case = Case::new(name)?;
    let assemble = watch.lap();
    let model = &case.model;
    let rows = model.contact_rows(&case.contact);
    let solver = TwoLevelSolver::new(model.stiffness(), &model.unknowns())?;
    let set_up = watch.lap();
    let block = solver.inverse_block(&rows)?;
    let flexibility = watch.lap();
    for (stage, [wall, cpu]) in [("assemble", assemble), ("set_up", set_up), ("flexibility", flexibility)] {
        println!("{stage}_wall {wall:.4}\n{stage}_cpu {cpu:.4}");
    }
    let trace: f64 = (0..rows.len()).map(|i| block.values.at(i, i)).sum();
    println!("unknowns {}\ncontact {}\ncoarse {}", solver.n(), rows.len(), solver.n_coarse());
    println!("iterations {}\nresidual {:.1e}", block.convergence.iterations, block.residual);
    println!("peak_bytes {}\ntrace {trace:.15e}", orthowear::output::peak_memory::peak_bytes());
    Ok(())
}
