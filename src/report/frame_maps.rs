//! Fields on the contact frame for the maps of a report.

use nalgebra::Vector3;
use serde_json::{Map, Value, json};

use crate::report::encode::{encode_f32, encode_u32};
use crate::report::result_directory::ResultDirectory;
use crate::report::vtu_reader::VtuGrid;

const MAX_MAP_CELLS: usize = 100_000;
/// Maximum number of embedded values (4 bytes each) of all entries.
const MAX_MAP_NUMBERS: usize = 4 << 20;
/// Largest number of embedded values per cell and entry.
const NUMBERS_PER_CELL: usize = 11;

#[derive(Default)]
pub(super) struct Frames {
    pub meshes: Vec<Value>,
    pub list: Vec<Value>,
}

/// Fields of the maps: name on the page, name in the file, component.
const MAP_FIELDS: [(&str, &str, usize); 10] = [
    ("pressure", "pressure", 0),
    ("traction_x", "traction", 0),
    ("traction_y", "traction", 1),
    ("slip_x", "slip", 0),
    ("slip_y", "slip", 1),
    ("gap", "gap", 2),
    ("wear", "wear_depth", 0),
    ("wear1", "wear_depth_body1", 0),
    ("wear2", "wear_depth_body2", 0),
    ("wear_error", "wear_depth_error", 0),
];

impl Frames {
    /// Reads the frame files of a run. Omitted files are reported in `source.problems`.
    pub(super) fn read(source: &mut ResultDirectory) -> Self {
        let mut frames = Self::default();
        let files = source.series("frame");
        let entries = entries_of_files(&source.summary, &files);
        let chosen = select_files(source, &files, &entries);
        if chosen.len() < files.len() && !chosen.is_empty() {
            source.problems.push(format!(
                "of {} entries with fields, the maps show {} (the last entry of each step first), because the page would be too large",
                files.len(),
                chosen.len()
            ));
        }
        let axes = MapPlane::of(&source.summary);
        let mut known: Vec<VtuGrid> = Vec::new();
        for index in chosen {
            let name = &files[index].1;
            match VtuGrid::read(&source.path(name)) {
                Ok(grid) if grid.n_cells() > MAX_MAP_CELLS => source.problems.push(format!(
                    "{name} is omitted: its frame has {} cells; at most {MAX_MAP_CELLS} are shown",
                    grid.n_cells()
                )),
                Ok(grid) => frames.add(grid, files[index].0, entries[index], &axes, &mut known),
                Err(error) => source.problems.push(format!("{name} is damaged and omitted: {error}")),
            }
        }
        frames
    }

    fn add(
        &mut self,
        grid: VtuGrid,
        number: usize,
        entry: Option<usize>,
        axes: &MapPlane,
        known: &mut Vec<VtuGrid>,
    ) {
        let mut fields = Map::new();
        for (name, field, component) in MAP_FIELDS {
            let Some(field) = grid.cell_field(field) else { continue };
            let values = field.component(component);
            if values.iter().any(|value| *value != 0.0) {
                fields.insert(name.to_owned(), encode_f32(values));
            }
        }
        if let Some(status) = grid.cell_field("status") {
            fields.insert("status".to_owned(), encode_f32(status.values.iter().copied()));
        }
        let same = |other: &VtuGrid| other.points == grid.points && other.connectivity == grid.connectivity;
        let mesh = known.iter().position(same).unwrap_or_else(|| {
            self.meshes.push(axes.mesh(&grid));
            known.push(VtuGrid { point_data: Vec::new(), cell_data: Vec::new(), ..grid.clone() });
            known.len() - 1
        });
        self.list.push(
            json!({ "file": number, "entry": entry, "mesh": mesh, "n": grid.n_cells(), "fields": fields }),
        );
    }
}

/// Index (from 0) of the summary entry of each field file; the number in the file name is one more. `None` if the summary has no
/// such entry.
pub(super) fn entries_of_files(said: &Value, files: &[(usize, String)]) -> Vec<Option<usize>> {
    let n = said["steps"].as_array().map_or(0, Vec::len);
    files.iter().map(|(number, _)| number.checked_sub(1).filter(|&entry| entry < n)).collect()
}

pub(super) fn last_files_of_steps(said: &Value, entries: &[Option<usize>]) -> Vec<usize> {
    let name = |index: usize| entries[index].map(|entry| said["steps"][entry]["name"].clone());
    (0..entries.len()).filter(|&i| i + 1 == entries.len() || name(i) != name(i + 1)).collect()
}

/// Indices of the files to embed. If not all fit, the last file of each step is chosen first (late steps before early ones), then
/// other files at even distances.
fn select_files(
    source: &ResultDirectory,
    files: &[(usize, String)],
    entries: &[Option<usize>],
) -> Vec<usize> {
    let sound = files.iter().rev().find_map(|(_, name)| VtuGrid::read(&source.path(name)).ok());
    let cells = sound.map_or(1, |grid| grid.n_cells().max(1));
    let most = (MAX_MAP_NUMBERS / (NUMBERS_PER_CELL * cells)).max(1);
    if files.len() <= most {
        return (0..files.len()).collect();
    }
    let ends = last_files_of_steps(&source.summary, entries);
    let mut chosen: Vec<usize> = ends.iter().rev().take(most).copied().collect();
    let others: Vec<usize> = (0..files.len()).filter(|index| !ends.contains(index)).collect();
    let room = (most - chosen.len()).min(others.len());
    chosen.extend((0..room).map(|i| others[i * others.len() / room]));
    chosen.sort_unstable();
    chosen
}

struct MapPlane {
    center: [f64; 2],
    azimuth: f64,
}

impl MapPlane {
    fn of(said: &Value) -> Self {
        let frame = &said["scene"]["frame"];
        let number = |value: &Value| value.as_f64().filter(|x| x.is_finite()).unwrap_or(0.0);
        let center = [0, 1].map(|axis| number(&frame["center"][axis]));
        Self { center, azimuth: number(&frame["azimuth"]).to_radians() }
    }

    /// Cells, and their points in space and on the plane of the map, as JSON.
    fn mesh(&self, grid: &VtuGrid) -> Value {
        let doubled: Vec<Vector3<f64>> =
            (0..grid.n_cells()).map(|cell| doubled_area_vector(grid, cell)).collect();
        let sum: Vector3<f64> = doubled.iter().sum();
        let total: f64 = doubled.iter().map(Vector3::norm).sum();
        let (sin, cos) = self.azimuth.sin_cos();
        // The map is a projection along z, as in the figures of a run, unless the frame is nearly parallel to z.
        let upright = sum.z.abs() >= 0.3 * sum.norm();
        let [x, y] =
            if upright { [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0)] } else { across(&sum) };
        let from = if upright { Vector3::new(self.center[0], self.center[1], 0.0) } else { Vector3::zeros() };
        let points: Vec<Vector3<f64>> = grid.points.iter().map(|p| Vector3::from(*p)).collect();
        let plane = points.iter().flat_map(|p| [(p - from).dot(&x), (p - from).dot(&y)]);
        let shown: f64 = doubled.iter().map(|area| area.dot(&x.cross(&y)).abs()).sum();
        json!({
            "plane": encode_f32(plane),
            "points": encode_f32(grid.points.iter().flatten().copied()),
            "offsets": encode_u32(grid.offsets.iter().copied()),
            "connectivity": encode_u32(grid.connectivity.iter().copied()),
            "curved": shown < 0.98 * total,
            "upright": upright,
        })
    }
}

fn doubled_area_vector(grid: &VtuGrid, cell: usize) -> Vector3<f64> {
    let at = |point: usize| Vector3::from(grid.points[point]);
    let corners = grid.cell(cell);
    let next = corners.iter().cycle().skip(1);
    let Some(&first) = corners.first() else { return Vector3::zeros() };
    corners.iter().zip(next).map(|(&a, &b)| (at(a) - at(first)).cross(&(at(b) - at(first)))).sum()
}

/// Two unit vectors perpendicular to a normal; the second is as close to z as possible.
fn across(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let x = Vector3::z().cross(normal).normalize();
    [x, normal.normalize().cross(&x)]
}
