//! Meshes of rectangular blocks of hexahedra or tetrahedra. The contact face may be distorted in its plane.

use std::sync::Arc;

use orthowear::element::ElementKind;
use orthowear::fem::{FeSpec, HexFormulation, Support};
use orthowear::material::Stiffness;
use orthowear::mesh::{CellBlock, CellRef, Mesh, PhysicalGroup};

/// A block of the half-widths `width` along x and y about the origin, between the heights `z[0]` and `z[1]`.
pub struct Brick {
    pub width: [f64; 2],
    pub z: [f64; 2],
    pub cells: [usize; 3],
    pub contact_on_top: bool,
    /// In-plane displacement of a point (x, y) of the contact face, for the face scaled to the square [-1, 1]². It is zero on the
    /// outline.
    pub distortion: fn([f64; 2]) -> [f64; 2],
    pub tetrahedra: bool,
}

pub fn straight(_: [f64; 2]) -> [f64; 2] {
    [0.0, 0.0]
}

/// Distortion that turns every inner rectangle into a general quadrangle.
pub fn wavy([x, y]: [f64; 2]) -> [f64; 2] {
    let bump = (1.0 - x * x) * (1.0 - y * y);
    [0.22 * bump * (2.0 * y + 0.3).sin(), -0.18 * bump * (2.3 * x).cos()]
}

const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];

impl Brick {
    pub fn mesh(&self) -> Mesh {
        let [nx, ny, nz] = self.cells;
        let node = |i: usize, j: usize, k: usize| (i * (ny + 1) + j) * (nz + 1) + k;
        let mut points = Vec::new();
        for i in 0..=nx {
            for j in 0..=ny {
                let flat = [2.0 * i as f64 / nx as f64 - 1.0, 2.0 * j as f64 / ny as f64 - 1.0];
                let shift = (self.distortion)(flat);
                for k in 0..=nz {
                    let z = self.z[0] + (self.z[1] - self.z[0]) * k as f64 / nz as f64;
                    points.push([
                        (flat[0] + shift[0]) * self.width[0],
                        (flat[1] + shift[1]) * self.width[1],
                        z,
                    ]);
                }
            }
        }
        let mut solids = Vec::new();
        let mut faces = [Vec::new(), Vec::new()];
        for i in 0..nx {
            for j in 0..ny {
                for k in 0..nz {
                    let layer = |k: usize| {
                        [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)]
                    };
                    let hexahedron = [layer(k), layer(k + 1)].concat();
                    if self.tetrahedra {
                        solids.extend(TETRAHEDRA.iter().flatten().map(|&c| hexahedron[c]));
                    } else {
                        solids.extend(hexahedron);
                    }
                }
                for (side, k) in [(0, 0), (1, nz)] {
                    let [a, b, c, d] =
                        [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
                    if self.tetrahedra {
                        // The triangles follow the diagonals of `TETRAHEDRA`.
                        faces[side].extend([a, b, c, a, c, d]);
                    } else {
                        faces[side].extend([a, b, c, d]);
                    }
                }
            }
        }
        let (solid, face) = if self.tetrahedra {
            (ElementKind::Tet4, ElementKind::Tri3)
        } else {
            (ElementKind::Hex8, ElementKind::Quad4)
        };
        let block = |kind: ElementKind, nodes: Vec<usize>, first: u64| {
            let n = (nodes.len() / kind.n_nodes()) as u64;
            CellBlock { kind, nodes, tags: (first..first + n).collect() }
        };
        let [bottom, top] = faces;
        let base_z = if self.contact_on_top { 0 } else { nz };
        let pins = [vec![node(0, 0, base_z)], vec![node(nx, 0, base_z)]];
        let [pin, second_pin] = pins.map(|nodes| block(ElementKind::Point1, nodes, 300_001));
        let blocks = vec![
            block(solid, solids, 1),
            block(face, bottom, 100_001),
            block(face, top, 200_001),
            pin,
            second_pin,
        ];
        let group = |name: &str, dim: usize, index: usize| PhysicalGroup {
            name: name.into(),
            dim,
            tag: index as i64 + 1,
            cells: (0..blocks[index].tags.len()).map(|cell| CellRef { block: index, cell }).collect(),
        };
        let (contact, base) = if self.contact_on_top { (2, 1) } else { (1, 2) };
        let groups = vec![
            group("volume", 3, 0),
            group("contact", 2, contact),
            group("base", 2, base),
            group("pin", 0, 3),
            group("second-pin", 0, 4),
        ];
        Mesh { source: "brick".into(), points, blocks, groups, ..Mesh::default() }
    }
}

pub fn spec(mesh: Mesh, stiffness: &Stiffness) -> FeSpec {
    FeSpec {
        name: "brick".into(),
        mesh: Arc::new(mesh),
        regions: vec![(None, stiffness.clone().into())],
        formulation: HexFormulation::Enhanced,
        supports: Vec::new(),
        foundations: Vec::new(),
        pressures: Vec::new(),
        tractions: Vec::new(),
        body_force: [0.0; 3],
        temperature_change: 0.0,
    }
}

pub fn support(group: &str, components: [bool; 3], value: [f64; 3]) -> Support {
    Support { group: group.into(), components, value, gradient: [[0.0; 3]; 3] }
}

/// Supports that let a block strain uniformly: rollers at the base, and two pins that prevent motions in the plane.
pub fn rollers() -> Vec<Support> {
    vec![
        support("base", [false, false, true], [0.0; 3]),
        support("pin", [true, true, false], [0.0; 3]),
        support("second-pin", [false, true, false], [0.0; 3]),
    ]
}
