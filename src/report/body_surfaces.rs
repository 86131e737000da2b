//! Surfaces of the bodies at the ends of the steps, for the three-dimensional view.

use nalgebra::Vector3;
use serde_json::{Map, Value, json};

use crate::report::encode::{encode_f32, encode_u32};
use crate::report::frame_maps::{entries_of_files, last_files_of_steps};
use crate::report::result_directory::ResultDirectory;
use crate::report::vtu_reader::VtuGrid;

const MAX_SURFACE_TRIANGLES: usize = 200_000;
/// Maximum number of embedded values (4 bytes each) of all surfaces.
const MAX_SURFACE_NUMBERS: usize = 6 << 20;

#[derive(Default)]
pub(super) struct Bodies {
    /// Distinct surfaces: triangles and undeformed points.
    pub surfaces: Vec<Value>,
    /// Fields at the end of a step, one item per body and step.
    pub list: Vec<Value>,
    known: Vec<KnownSurface>,
    numbers: usize,
}

struct KnownSurface {
    undeformed_points: Vec<[f64; 3]>,
    triangles: Vec<[usize; 3]>,
}

impl Bodies {
    /// Reads the surfaces of both bodies, last step first. Omitted files are reported in `source.problems`.
    pub(super) fn read(source: &mut ResultDirectory) -> Self {
        let mut bodies = Self::default();
        for body in [1, 2] {
            let files = source.series(&format!("body{body}"));
            let entries = entries_of_files(&source.summary, &files);
            for index in last_files_of_steps(&source.summary, &entries).into_iter().rev() {
                let (number, name) = &files[index];
                let read = VtuGrid::read(&source.path(name))
                    .map_err(|error| format!("is damaged and omitted: {error}"));
                if let Err(why) = read.and_then(|grid| bodies.add(&grid, body, *number)) {
                    source.problems.push(format!("{name} {why}"));
                }
            }
        }
        bodies
    }

    fn add(&mut self, grid: &VtuGrid, body: usize, number: usize) -> Result<(), String> {
        let triangles = triangles(grid);
        if triangles.len() > MAX_SURFACE_TRIANGLES {
            return Err(format!(
                "is omitted from the 3D view: it has {} triangles; at most {MAX_SURFACE_TRIANGLES} are shown",
                triangles.len()
            ));
        }
        let displacement = grid.point_field("displacement").filter(|field| field.components == 3);
        let displacement =
            displacement.map_or_else(|| vec![0.0; 3 * grid.points.len()], |field| field.values.clone());
        let undeformed_points: Vec<[f64; 3]> = grid
            .points
            .iter()
            .zip(displacement.chunks_exact(3))
            .map(|(p, u)| [p[0] - u[0], p[1] - u[1], p[2] - u[2]])
            .collect();
        self.numbers += 6 * undeformed_points.len() + 3 * triangles.len();
        if self.numbers > MAX_SURFACE_NUMBERS {
            return Err("is omitted from the 3D view, because the page would be too large".to_owned());
        }
        let mut fields = Map::new();
        fields.insert("pressure".to_owned(), encode_f32(normal_traction(grid, &triangles)));
        for name in ["von_mises", "sigma_tangential"] {
            if let Some(field) = grid.point_field(name) {
                fields.insert(name.to_owned(), encode_f32(field.values.iter().copied()));
            }
        }
        let surface = self.surface(KnownSurface { undeformed_points, triangles });
        self.list.push(json!({
            "body": body,
            "file": number,
            "surface": surface,
            "displacement": encode_f32(displacement),
            "fields": fields,
        }));
        Ok(())
    }

    /// Index of a surface in `surfaces`. A surface that is not in the list is added.
    fn surface(&mut self, surface: KnownSurface) -> usize {
        let size = surface.undeformed_points.iter().flatten().fold(0.0, |size: f64, x| size.max(x.abs()));
        let near = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-9 * size);
        let same = |known: &KnownSurface| {
            known.triangles == surface.triangles
                && known.undeformed_points.len() == surface.undeformed_points.len()
                && known.undeformed_points.iter().zip(&surface.undeformed_points).all(|(a, b)| near(a, b))
        };
        if let Some(index) = self.known.iter().position(same) {
            return index;
        }
        self.surfaces.push(json!({
            "points": encode_f32(surface.undeformed_points.iter().flatten().copied()),
            "triangles": encode_u32(surface.triangles.iter().flatten().copied()),
        }));
        self.known.push(surface);
        self.known.len() - 1
    }
}

/// Triangles of all cells of the grid. The triangles of quadratic faces also use the midside nodes.
fn triangles(grid: &VtuGrid) -> Vec<[usize; 3]> {
    let mut list = Vec::new();
    for (index, &kind) in grid.types.iter().enumerate() {
        let nodes = grid.cell(index);
        let parts: &[[usize; 3]] = match (kind, nodes.len()) {
            (22, 6) => &[[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
            (23, 8) => &[[0, 4, 7], [4, 1, 5], [5, 2, 6], [6, 3, 7], [4, 5, 6], [4, 6, 7]],
            (28, 9) => {
                &[[0, 4, 8], [4, 1, 8], [1, 5, 8], [5, 2, 8], [2, 6, 8], [6, 3, 8], [3, 7, 8], [7, 0, 8]]
            }
            _ => &[],
        };
        list.extend(parts.iter().map(|part| part.map(|i| nodes[i])));
        if parts.is_empty() {
            list.extend((1..nodes.len().saturating_sub(1)).map(|i| [nodes[0], nodes[i], nodes[i + 1]]));
        }
    }
    list
}

/// Magnitude of the normal traction at each point. It is the contact pressure, because contact tractions are compressive.
fn normal_traction(grid: &VtuGrid, triangles: &[[usize; 3]]) -> Vec<f64> {
    let Some(traction) = grid.point_field("traction").filter(|field| field.components == 3) else {
        return vec![0.0; grid.points.len()];
    };
    let mut normals = vec![Vector3::zeros(); grid.points.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|point| Vector3::from(grid.points[point]));
        let area = (b - a).cross(&(c - a));
        triangle.iter().for_each(|&point| normals[point] += area);
    }
    let along = |(t, normal): (&[f64], &Vector3<f64>)| {
        let length = normal.norm();
        if length > 0.0 { (Vector3::new(t[0], t[1], t[2]).dot(normal) / length).abs() } else { 0.0 }
    };
    traction.values.chunks_exact(3).zip(&normals).map(along).collect()
}
