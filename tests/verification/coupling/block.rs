//! The assembled block system against the Schur complement (docs/theory-coupling.md).

use std::sync::Arc;

use super::bricks::{Brick, spec, straight, support, wavy};
use super::half_spaces::{cfrp, difference, gaps};
use super::random;
use crate::common::steel;
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{BodyField, ElasticBody, FeBody, HalfSpaceBody, Loading, RigidBody};
use orthowear::coupling::{BlockSystem, CoupledBodies, Coupling, couple};
use orthowear::error::{ErrorKind, Result};
use orthowear::flexibility::Flexibility;
use orthowear::frame::{ContactFrame, Side};

fn frame() -> ContactFrame {
    ContactFrame::grid([1.1, 0.9], [5, 4], [0.1, -0.2], 0.3).expect("an admissible grid")
}

/// A block with loads and displaced supports. In body 1, the node nearest to the origin has prescribed displacements along x and
/// z.
fn finite_elements(side: Side, frame: &ContactFrame) -> FeBody {
    let lower = side == Side::Lower;
    let brick = Brick {
        width: [2.0, 1.5],
        z: if lower { [-1.1, 0.0] } else { [0.0, 0.7] },
        cells: if lower { [6, 5, 2] } else { [5, 7, 2] },
        contact_on_top: lower,
        distortion: if lower { wavy } else { straight },
        tetrahedra: !lower,
    };
    let mut mesh = brick.mesh();
    if lower {
        let distance = |x: &[f64; 3]| x[0] * x[0] + x[1] * x[1] + 100.0 * x[2] * x[2];
        let nearest = (0..mesh.points.len())
            .min_by(|&a, &b| distance(&mesh.points[a]).total_cmp(&distance(&mesh.points[b])));
        mesh.blocks[3].nodes[0] = nearest.expect("a mesh with points");
    }
    let mut spec = spec(mesh, &if lower { cfrp(30.0, 20.0) } else { steel() });
    spec.supports = vec![support("base", [true; 3], if lower { [0.0; 3] } else { [0.002, 0.001, -0.003] })];
    if lower {
        spec.supports.push(support("pin", [true, false, true], [0.001, 0.0, -0.002]));
    }
    spec.body_force = [1.0, -2.0, 3.0];
    spec.pressures = vec![("contact".into(), 2.0)];
    FeBody::new(spec, "contact", side, frame).expect("a finite-element body")
}

fn half_space(side: Side, frame: &ContactFrame) -> HalfSpaceBody {
    let stiffness = if side == Side::Lower { cfrp(30.0, 20.0) } else { steel() };
    HalfSpaceBody::new(&stiffness, side, frame).expect("a half-space")
}

pub type Pair = [Box<dyn ElasticBody>; 2];

pub fn pairs(frame: &ContactFrame) -> Vec<(&'static str, Pair)> {
    let fe = |side| -> Box<dyn ElasticBody> { Box::new(finite_elements(side, frame)) };
    let be = |side| -> Box<dyn ElasticBody> { Box::new(half_space(side, frame)) };
    vec![
        ("FE-FE", [fe(Side::Lower), fe(Side::Upper)]),
        ("FE-BE", [fe(Side::Lower), be(Side::Upper)]),
        ("BE-FE", [be(Side::Lower), fe(Side::Upper)]),
        ("BE-BE", [be(Side::Lower), be(Side::Upper)]),
        ("FE-rigid", [fe(Side::Lower), Box::new(RigidBody)]),
        ("rigid-BE", [Box::new(RigidBody), be(Side::Upper)]),
    ]
}

pub fn tied([lower, upper]: &mut Pair, frame: &ContactFrame, coupling: Coupling) -> CoupledBodies {
    couple(lower.as_mut(), upper.as_mut(), frame, coupling, SkipVanishing).expect("coupled bodies")
}

/// Truth: the Schur complement. Eliminating the unknowns of the bodies from the block system must not change the gaps. Wear depth
/// and initial gap contribute to the normal gap only. The relative tolerance 1e-10 covers different factorisations of the same
/// matrices, and the difference between FFT and dense products.
#[test]
fn both_paths_give_the_same_gaps() {
    let frame = frame();
    let n = frame.n_cells();
    let (tractions, extra) = (random(3 * n), random(5 * n));
    let (distance, worn) = (&extra[3 * n..4 * n], &extra[4 * n..]);
    for (name, mut pair) in pairs(&frame) {
        let block = tied(&mut pair, &frame, Coupling::Block);
        let system = BlockSystem::new(pair[0].as_ref(), pair[1].as_ref(), &frame).expect("a block system");
        let schur = tied(&mut pair, &frame, Coupling::Schur);
        let apart = difference(&gaps(&block, &tractions), &gaps(&schur, &tractions));
        assert!(apart < 1e-10, "{name}: S P differs by {apart:e}");
        if name.contains("FE") {
            assert_eq!(
                (block.loads.len(), schur.loads.len()),
                (1 + usize::from(name == "FE-FE"), block.loads.len())
            );
            for (block, schur) in block.loads.iter().zip(&schur.loads) {
                let apart = difference(&block.gap, &schur.gap);
                assert!(apart < 1e-10, "{name}: gaps by loads differ by {apart:e}");
            }
        } else {
            assert!(block.loads.is_empty() && schur.loads.is_empty());
        }
        let pressure = &tractions[2 * n..];
        let mut normal = [vec![0.0; n], vec![0.0; n]];
        block.flexibility.apply_normal(pressure, &mut normal[0]);
        schur.flexibility.apply_normal(pressure, &mut normal[1]);
        assert!(difference(&normal[0], &normal[1]) < 1e-10, "{name}: normal part");
        let scale = block.flexibility.diagonal_blocks()[0].amax();
        for (a, b) in
            block.flexibility.diagonal_blocks().iter().zip(schur.flexibility.diagonal_blocks().iter())
        {
            assert!((a - b).amax() < 1e-10 * scale, "{name}: diagonal blocks\n{a}{b}");
        }
        let mut gap = vec![0.0; 3 * n];
        system.gap(&tractions, distance, worn, &mut gap);
        let mut expected = schur.initial_gap(distance);
        expected.iter_mut().zip(gaps(&schur, &tractions)).for_each(|(g, s)| *g += s);
        for load in &schur.loads {
            expected.iter_mut().zip(&load.gap).for_each(|(g, by)| *g += by);
        }
        expected[2 * n..].iter_mut().zip(worn).for_each(|(g, w)| *g += w);
        assert!(difference(&gap, &expected) < 1e-10, "{name}: k with wear");
    }
}

struct Closed;

impl ElasticBody for Closed {
    fn describe(&self) -> String {
        "closed".into()
    }

    fn take_flexibility(
        &mut self,
        _cross: orthowear::bem::half_space::CrossBlocks,
    ) -> Result<Option<Arc<dyn Flexibility>>> {
        Ok(None)
    }

    fn recover(&self, _loading: Loading) -> Result<BodyField> {
        Ok(BodyField::default())
    }
}

/// Truth: the block system is refused if both bodies are rigid, if a body has no equations, or if the memory does not suffice.
#[test]
fn what_the_block_system_cannot_do_is_refused() {
    let frame = frame();
    let refused =
        |lower: &mut dyn ElasticBody, upper: &mut dyn ElasticBody, frame: &ContactFrame, word: &str| {
            let error = couple(lower, upper, frame, Coupling::Block, SkipVanishing).err().expect("a refusal");
            assert!(error.message().contains(word), "{error}");
            error.kind()
        };
    assert_eq!(refused(&mut RigidBody, &mut RigidBody, &frame, "both bodies are rigid"), ErrorKind::Input);
    assert_eq!(refused(&mut RigidBody, &mut Closed, &frame, "body 2 (closed)"), ErrorKind::Input);
    let large = ContactFrame::grid([1.0, 1.0], [150, 150], [0.0; 2], 0.0).unwrap();
    let mut upper = half_space(Side::Upper, &large);
    assert_eq!(refused(&mut RigidBody, &mut upper, &large, "135000 unknowns"), ErrorKind::Resources);
}
