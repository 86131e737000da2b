//! Friction and wear on bodies with the near field of a half-space, against condensed meshes.

use orthowear::body::{ElasticBody, FeBody};
use orthowear::contact::SolverOptions;
use orthowear::element::ElementKind::Hex27;
use orthowear::evolution::run;
use orthowear::evolution::step::Integrator;
use orthowear::fem::HexFormulation;
use orthowear::frame::{ContactFrame, Side};

use super::blocks::{FRAME, body, cfrp, frame, hybrid};
use super::hertz::sphere_on;
use crate::common::{Silent, fretting, frp_friction, frp_wear, indent, shift, usual_or_finest};
use crate::fem_bodies::{clamp, spec};
use crate::structured::GradedBlock;

/// Normal force and tangential forces along x and y after the tangential displacement, and wear volume after the fretting cycles.
fn history(body: &mut dyn ElasticBody, frame: &ContactFrame) -> [f64; 4] {
    let mut model = sphere_on(body, Side::Lower, frame);
    (model.friction, model.wear) = (frp_friction(30.0), frp_wear(30.0));
    let steps = [indent(0.02), shift(0.008, 30.0), fretting(20_000, 0.03, 2, Integrator::Sdirk2)];
    let result = run(&model, &steps, &SolverOptions::default(), None, &mut Silent).unwrap();
    let at = |name: &str| result.records.iter().rfind(|record| record.name == name).unwrap();
    let moved = at("shift");
    let worn = result.records.last().unwrap().worn_volume;
    [moved.normal_force, moved.tangential_force[0], moved.tangential_force[1], worn]
}

/// Truth: forces and wear volume with the near field of a half-space. Their errors are a few thousandths. Condensed meshes must
/// converge to these results, to 3 % on the finer mesh.
#[test]
fn indentation_shift_and_wear() {
    let condensed = |cells: usize, patch: usize| {
        let mesh = GradedBlock {
            half_width: [3.0; 2],
            depth: 3.0,
            patch_half_width: [FRAME; 2],
            patch_cells: [patch; 2],
            outer_cells: patch / 3,
            depth_cells: patch,
            first_depth: Some(2.0 * FRAME / patch as f64),
            ..GradedBlock::uniform([3.0; 2], 3.0, [1; 3])
        };
        let body = spec(mesh.mesh().unwrap(), cfrp(), HexFormulation::Enhanced, vec![clamp("base")]);
        let frame = frame(cells);
        history(&mut FeBody::new(body, "contact", Side::Lower, &frame).unwrap(), &frame)
    };
    let finite = |cells: usize| {
        let frame = frame(cells);
        history(&mut hybrid(body(Hex27, (3.0, 8, 3.0), &cfrp()), "z1", Side::Lower, &frame), &frame)
    };
    let (coarse, fine) = (condensed(8, 12), condensed(16, 24));
    let wanted = finite(usual_or_finest(48, 64));
    println!("{coarse:?}\n{fine:?}\n{wanted:?}");
    for (k, name) in ["normal force", "force along x", "force along y", "worn volume"].iter().enumerate() {
        let off = [coarse[k], fine[k]].map(|value| (value / wanted[k] - 1.0).abs());
        assert!(off[1] < 0.03 && off[1] < off[0], "{name}: {off:?}");
    }
}
