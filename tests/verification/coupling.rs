//! Two bodies coupled on one contact frame: maps to the contact faces, patch tests, and the Schur complement against the
//! assembled block system.

mod block;
mod bricks;
mod candidates;
mod catalogue;
mod curved;
mod curved_pairs;
mod entries;
pub mod finite_block;
mod finite_elements;
mod floating;
pub mod grids;
mod half_spaces;
mod lap_joint;
mod maps;
mod nodes;
mod order_two;
mod pairs;
mod quadratic;
mod rigid_partner;
mod soft;
mod states;
mod symmetry_planes;
mod thick_plate;
mod touch;
mod two_solvers;

/// Values in [-1, 1), the same in every run (linear congruential generator).
fn random(n: usize) -> Vec<f64> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    (0..n)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}
