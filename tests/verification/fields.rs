//! Values in field files, against direct formulas and against the values that meshio and VTK read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use orthowear::bem::half_space::CrossBlocks;
use orthowear::body::{BodyField, ElasticBody, ErrorEstimation, Loading, StressField};
use orthowear::element::ElementKind;
use orthowear::error::Result;
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord, Outcome};
use orthowear::fem::RecoveryPoints;
use orthowear::flexibility::Flexibility;
use orthowear::frame::ContactFrame;
use orthowear::geometry::Side;
use orthowear::mesh::{CellBlock, Mesh};
use orthowear::output::body_fields::{BodyOutput, RecoveryLocation, surface_grid};
use orthowear::output::cell_locator::{CellLocator, SurfacePoint};
use orthowear::output::field_writer::{FieldKind, FieldWriter};
use orthowear::output::frame_fields::{FrameMesh, frame_grid};
use orthowear::output::output_dir::OutputDir;
use orthowear::output::recorder::Recorder;
use orthowear::output::summary::{Summary, Units};
use orthowear::output::surface_properties::SurfaceProperties;
use orthowear::output::volume::volume_grid;
use orthowear::output::vtu::{ArrayValues, DataArray, UnstructuredGrid};

/// A body with the given points. Its displacement is [`displacement`] under any tractions.
struct AffineBody(Vec<[f64; 3]>);

fn displacement(x: &[f64; 3]) -> [f64; 3] {
    let gradient = Matrix3::new(1e-3, 2e-3, -5e-4, 0.0, -3e-3, 7e-4, 4e-4, 1e-3, -2e-3);
    (gradient * Vector3::from(*x) + Vector3::new(0.1, -0.2, 0.3)).into()
}

impl ElasticBody for AffineBody {
    fn describe(&self) -> String {
        "affine field".into()
    }

    fn take_flexibility(&mut self, _cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>> {
        Ok(None)
    }

    fn recover(&self, _loading: Loading) -> Result<BodyField> {
        Ok(BodyField { displacement: self.0.iter().map(displacement).collect(), stress: None })
    }

    fn recover_stress(
        &self,
        _loading: Loading,
        _displacement: &[[f64; 3]],
        _estimate: ErrorEstimation,
    ) -> Result<Option<StressField>> {
        let stress = |x: &[f64; 3]| [x[0], x[1], x[2], 10.0 + x[0], 20.0 + x[1], 30.0 + x[2]];
        let n = self.0.len();
        let points = RecoveryPoints {
            mesh_nodes: (0..n).collect(),
            cell_points: (0..n).collect(),
            offsets: vec![0, n],
        };
        Ok(Some(StressField {
            points: Arc::new(points),
            stress: self.0.iter().map(stress).collect(),
            exposures: Vec::new(),
            contact: Vec::new(),
            error: None,
        }))
    }
}

fn whole_field(body: &AffineBody) -> BodyField {
    let field = body.recover(Loading::of_contact(&[])).expect("a field");
    let stress = body
        .recover_stress(Loading::of_contact(&[]), &field.displacement, ErrorEstimation::Skip)
        .expect("a stress");
    BodyField { stress, ..field }
}

/// Irregular numbers in [-1, 1), from multiples of the golden ratio. No two are equal, so that tests detect permuted entries.
fn scattered(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| 2.0 * ((i as f64 + seed) * 0.618_033_988_749_894_9).fract() - 1.0).collect()
}

fn state(n: usize) -> FrameState {
    FrameState {
        tractions: scattered(3 * n, 1.0),
        gap: scattered(3 * n, 2.3),
        slip: scattered(2 * n, 3.7),
        status: (0..n).map(|i| (i % 3) as u8).collect(),
        wear_depth: scattered(n, 4.1),
        wear_depth_error: scattered(n, 5.3),
        load_amplitudes: Vec::new(),
    }
}

fn frame() -> ContactFrame {
    ContactFrame::grid([0.9, 0.5], [3, 2], [0.2, -0.1], 30_f64.to_radians()).expect("a frame")
}

fn reals(arrays: &[DataArray], name: &str) -> Vec<f64> {
    let array = arrays.iter().find(|array| array.name == name).unwrap_or_else(|| panic!("no array {name}"));
    match &array.values {
        ArrayValues::Float64(values) => values.clone(),
        _ => panic!("{name} is not real"),
    }
}

/// A unit cube with mid-edge nodes in gmsh's node order (reference manual, "Node ordering").
fn quadratic_cube() -> Mesh {
    let corners = [
        [0.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [1.0, 1.0, -1.0],
        [0.0, 1.0, -1.0],
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let edges =
        [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)];
    one_cell(ElementKind::Hex20, &corners, &edges)
}

fn quadratic_tetrahedron() -> Mesh {
    let corners = [[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 0.0]];
    one_cell(ElementKind::Tet10, &corners, &[(0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3)])
}

fn one_cell(kind: ElementKind, corners: &[[f64; 3]], edges: &[(usize, usize)]) -> Mesh {
    let middle = |&(i, j): &(usize, usize)| [0, 1, 2].map(|k| 0.5 * (corners[i][k] + corners[j][k]));
    let points: Vec<[f64; 3]> = corners.iter().copied().chain(edges.iter().map(middle)).collect();
    let block = CellBlock { kind, nodes: (0..points.len()).collect(), tags: vec![1] };
    Mesh { source: "by hand".into(), points, blocks: vec![block], ..Default::default() }
}

/// Truth: a state of six cells stores component k of cell i at index 6 k + i. The grid stores the components of each cell
/// together. A vector in global axes is the vector in frame axes, rotated by the azimuth of the frame.
#[test]
fn frame_fields_are_the_planes_by_cell() {
    let (frame, state) = (frame(), state(6));
    let grid =
        frame_grid(&frame, &FrameMesh::new(&frame), &SurfaceProperties::default(), &state).expect("a grid");
    assert_eq!((grid.points.len(), grid.types.as_slice()), (12, [9; 6].as_slice()), "shared corners");
    let (s, c) = 30_f64.to_radians().sin_cos();
    let traction = reals(&grid.cell_data, "traction");
    let global = reals(&grid.cell_data, "traction_global");
    for i in 0..6 {
        let planes = [0, 1, 2].map(|k| state.tractions[6 * k + i]);
        assert_eq!(traction[3 * i..3 * i + 3], planes);
        assert_eq!(reals(&grid.cell_data, "pressure")[i], planes[2]);
        assert_eq!(reals(&grid.cell_data, "gap")[3 * i + 1], state.gap[6 + i]);
        assert_eq!(reals(&grid.cell_data, "slip")[3 * i..3 * i + 3], [state.slip[i], state.slip[6 + i], 0.0]);
        let turned = [c * planes[0] - s * planes[1], s * planes[0] + c * planes[1], planes[2]];
        (0..3).for_each(|k| assert!((global[3 * i + k] - turned[k]).abs() < 1e-15));
    }
}

/// Truth: every point has the affine displacement. The contact nodes inside the frame carry the constant traction of the frame,
/// with the opposite sign on body 1. All other nodes carry no traction.
#[test]
fn surfaces_carry_displacement_and_traction() {
    let mesh = quadratic_cube();
    let frame = ContactFrame::grid([0.75, 2.0], [2, 2], [0.0, 0.0], 0.0).expect("a frame");
    let body = AffineBody(mesh.points.clone());
    let field = body.recover(Loading::of_contact(&[])).expect("a field");
    let lowest = mesh.points.iter().map(|x| x[2]).fold(0.0, f64::min);
    // The contact surface is the top of body 1 and the base of body 2.
    for (side, sign, height) in [(Side::Lower, -1.0, 0.0), (Side::Upper, 1.0, lowest)] {
        let contact: Vec<usize> = (0..mesh.n_points()).filter(|&i| mesh.points[i][2] == height).collect();
        let location = RecoveryLocation::MeshNodes { mesh: &mesh, contact_nodes: &contact };
        let output = BodyOutput { side, body: &body, location, first_load: 0 };
        let tractions = [[1.0, 2.0, 3.0]; 4];
        let grid =
            surface_grid(&output, &frame, &FrameMesh::new(&frame), &field, &tractions).expect("a grid");
        assert_eq!((grid.types.as_slice(), grid.points.len()), ([23; 6].as_slice(), 20));
        let (u, t) = (reals(&grid.point_data, "displacement"), reals(&grid.point_data, "traction"));
        for (i, point) in grid.points.iter().enumerate() {
            let reference = [0, 1, 2].map(|k| point[k] - u[3 * i + k]);
            let wanted = displacement(&reference);
            (0..3).for_each(|k| assert!((u[3 * i + k] - wanted[k]).abs() < 1e-15));
            let loaded = (reference[2] - height).abs() < 1e-12 && reference[0] < 0.75;
            let wanted = if loaded { [sign, 2.0 * sign, 3.0 * sign] } else { [0.0; 3] };
            (0..3).for_each(|k| assert!((t[3 * i + k] - wanted[k]).abs() < 1e-15, "{reference:?}"));
        }
    }
}

/// Truth: the grid and a frame that lists the same cells as polygons find the same cells at every point. Points on borders
/// between cells are included.
#[test]
fn a_frame_without_grid_is_searched_to_the_same_end() {
    let grid = frame();
    let polygons = grid.clone().retain_cells(&[true; 6]);
    let locators = [&grid, &polygons].map(|frame| CellLocator::new(frame, Side::Lower));
    let along = |i: usize, j: usize| {
        let local = Vector3::new(-1.2 + 0.15 * i as f64, -0.75 + 0.125 * j as f64, 0.0);
        grid.triads[0].to_global(&local) + grid.origin
    };
    let mut inside = 0;
    for point in (0..17).flat_map(|i| (0..13).map(move |j| along(i, j))) {
        let over = SurfacePoint { at: point, outward: Vector3::z() };
        let found = locators[0].cells_at(&over);
        assert_eq!(found, locators[1].cells_at(&over), "{point}");
        inside += usize::from(!found.is_empty());
    }
    assert_eq!(inside, 13 * 9, "points of the pattern inside 1.8 x 1.0, borders included");
}

/// Truth: a field of the wrong size is an error and is not truncated.
#[test]
fn a_recovered_field_that_does_not_fit_is_refused() {
    let field = BodyField { displacement: vec![[0.0; 3]; 7], stress: None };
    let message = volume_grid(&quadratic_cube(), &field).expect_err("7 of 20 nodes").to_string();
    assert!(message.contains("7 recovered displacements") && message.contains("20 nodes"), "{message}");
}

fn json_fields(arrays: &[DataArray]) -> serde_json::Value {
    let fields: BTreeMap<&str, serde_json::Value> = arrays
        .iter()
        .map(|array| {
            let width = array.components.len();
            let values = match &array.values {
                ArrayValues::Float64(v) if width > 0 => {
                    serde_json::json!(v.chunks(width).collect::<Vec<_>>())
                }
                ArrayValues::Float64(v) => serde_json::json!(v),
                ArrayValues::Int64(v) => serde_json::json!(v),
                ArrayValues::UInt8(v) => serde_json::json!(v),
            };
            (array.name.as_str(), serde_json::json!({ "components": array.components, "values": values }))
        })
        .collect();
    serde_json::json!(fields)
}

fn json_grid(grid: &UnstructuredGrid, straight: bool) -> serde_json::Value {
    let mut start = 0;
    let cells: Vec<&[i64]> = grid
        .offsets
        .iter()
        .map(|&end| {
            let cell = &grid.connectivity[start..end as usize];
            start = end as usize;
            cell
        })
        .collect();
    serde_json::json!({
        "points": grid.points, "cells": cells, "types": grid.types, "straight": straight,
        "point_data": json_fields(&grid.point_data), "cell_data": json_fields(&grid.cell_data),
    })
}

/// Python with meshio and VTK, from $ORTHOWEAR_PYTHON or from the .venv of the project. `None` if it is absent.
fn python() -> Option<PathBuf> {
    let program = std::env::var_os("ORTHOWEAR_PYTHON")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python"), PathBuf::from);
    let works = Command::new(&program).args(["-c", "import meshio, vtkmodules.vtkIOXML"]).output();
    if works.is_ok_and(|output| output.status.success()) {
        return Some(program);
    }
    let required = std::env::var("ORTHOWEAR_REQUIRE_TOOLS").is_ok_and(|value| value == "1");
    assert!(
        !required,
        "Python with meshio and VTK is not installed, but ORTHOWEAR_REQUIRE_TOOLS=1 requires it"
    );
    eprintln!("SKIPPED: Python with meshio and VTK is not installed (scripts/setup makes .venv)");
    None
}

fn compare_with_readers(dir: &Path, expected: &serde_json::Value) {
    let Some(python) = python() else { return };
    let path = dir.join("expected.json");
    std::fs::write(&path, expected.to_string()).expect("a written file");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/compare_fields.py");
    let output = Command::new(python).arg(script).arg(&path).output().expect("Python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Truth: meshio and VTK, two readers independent of the writer, return every array to the last bit. The middle nodes of
/// quadratic edges are midpoints.
#[test]
fn meshio_and_vtk_read_what_was_given() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (frame, cube, tetrahedron) = (frame(), quadratic_cube(), quadratic_tetrahedron());
    let cells = FrameMesh::new(&frame);
    let centers: Vec<[f64; 3]> = frame.centers.iter().map(|c| (*c).into()).collect();
    let (lower, upper) = (AffineBody(cube.points.clone()), AffineBody(centers));
    let bodies = vec![
        BodyOutput {
            side: Side::Lower,
            body: &lower,
            location: RecoveryLocation::MeshNodes { mesh: &cube, contact_nodes: &[4, 5, 6, 7] },
            first_load: 0,
        },
        BodyOutput { side: Side::Upper, body: &upper, location: RecoveryLocation::FrameCells, first_load: 0 },
    ];

    let writer = FieldWriter::new(&frame, bodies.clone(), &[FieldKind::Vtu, FieldKind::Volume]);
    let output = OutputDir::open(dir.path()).expect("an output directory");
    let mut recorder = Recorder::writing_to(Some(output)).with_fields(writer);
    let states = [state(6), FrameState { wear_depth: vec![1e-300; 6], ..state(6) }];
    for (i, state) in states.iter().enumerate() {
        let record = IncrementRecord { name: "indent".into(), increment: i + 1, ..Default::default() };
        recorder.increment_done(&record, state).expect("written fields");
    }
    let mut summary = Summary::new("", "", Units::default());
    summary.set_outcome(&Ok(Outcome::Converged));
    recorder.finish(&mut summary).expect("written results");

    let mut files = BTreeMap::new();
    for (i, state) in states.iter().enumerate() {
        let grid = frame_grid(&frame, &cells, &SurfaceProperties::default(), state).expect("a grid");
        files.insert(format!("frame_000{}.vtu", i + 1), json_grid(&grid, false));
        let planes = &state.tractions;
        let tractions: Vec<[f64; 3]> = (0..6).map(|c| [0, 1, 2].map(|k| planes[6 * k + c])).collect();
        for body in &bodies {
            let mut field = body.body.recover(Loading::of_contact(planes)).expect("a field");
            let stress = body.body.recover_stress(
                Loading::of_contact(planes),
                &field.displacement,
                ErrorEstimation::Estimate,
            );
            field.stress = stress.expect("a stress");
            let grid = surface_grid(body, &frame, &cells, &field, &tractions).expect("a grid");
            files.insert(format!("{}_000{}.vtu", body.side.key(), i + 1), json_grid(&grid, true));
        }
        let volume = volume_grid(&cube, &whole_field(&lower)).expect("a grid");
        files.insert(format!("body1_volume_000{}.vtu", i + 1), json_grid(&volume, true));
    }
    let field = whole_field(&AffineBody(tetrahedron.points.clone()));
    let grid = volume_grid(&tetrahedron, &field).expect("a grid");
    grid.write(&mut std::fs::File::create(dir.path().join("tetrahedron.vtu")).expect("a file"))
        .expect("written");
    files.insert("tetrahedron.vtu".into(), json_grid(&grid, true));
    let mixed = polygons();
    mixed
        .write(&mut std::fs::File::create(dir.path().join("polygons.vtu")).expect("a file"))
        .expect("written");
    files.insert("polygons.vtu".into(), json_grid(&mixed, true));

    let series = |name: &str| vec![(1.0, format!("{name}_0001.vtu")), (2.0, format!("{name}_0002.vtu"))];
    let collections: BTreeMap<String, _> = ["frame", "body1", "body2", "body1_volume"]
        .map(|name| (format!("{name}.pvd"), series(name)))
        .into_iter()
        .collect();
    assert!(collections.keys().chain(files.keys()).all(|name| dir.path().join(name).exists()));
    compare_with_readers(dir.path(), &serde_json::json!({ "files": files, "collections": collections }));
}

fn polygons() -> UnstructuredGrid {
    let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 2.0], [1.5, 2.0], [2.0, 1.0]]
        .map(|[x, y]| Vector3::new(x, y, 0.0));
    let corners = [vec![0, 1, 2, 3], vec![2, 4, 3], vec![1, 6, 5, 4, 2]];
    let frame = ContactFrame {
        polygons: Some(corners.iter().map(|cell| cell.iter().map(|&i| points[i]).collect()).collect()),
        ..ContactFrame::grid([1.0, 1.0], [3, 1], [0.0, 0.0], 0.0).expect("a frame")
    };
    let mut grid = FrameMesh::new(&frame).grid();
    assert_eq!((grid.types.as_slice(), grid.points.len()), ([9, 5, 7].as_slice(), 7));
    grid.cell_data.push(DataArray::scalar("wear_depth", scattered(3, 5.0)));
    grid
}

/// A frame of n x n cells with Hertzian pressure on a circle of radius 1. Cells within half this radius stick, other cells in
/// contact slip.
fn hertz(n: usize) -> (ContactFrame, FrameState) {
    let frame = ContactFrame::grid([1.2, 1.2], [n, n], [0.0, 0.0], 0.0).expect("a frame");
    let radius = |i: usize| frame.centers[i].xy().norm();
    let pressure = |i: usize| 140.0 * (1.0 - radius(i).powi(2)).max(0.0).sqrt();
    let cells = frame.n_cells();
    let mut state = FrameState {
        gap: vec![0.0; 3 * cells],
        slip: vec![0.0; 2 * cells],
        wear_depth: vec![0.0; cells],
        wear_depth_error: vec![0.0; cells],
        load_amplitudes: Vec::new(),
        status: (0..cells)
            .map(|i| if pressure(i) <= 0.0 { 0 } else { 1 + u8::from(radius(i) > 0.5) })
            .collect(),
        tractions: vec![0.0; 2 * cells],
    };
    state.tractions.extend((0..cells).map(pressure));
    (frame, state)
}

/// Truth: the pictures of a fine frame are well-formed XML, and smaller than 4 MiB.
#[test]
fn pictures_are_valid_and_small() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (frame, state) = hertz(256);
    let output = OutputDir::open(dir.path()).expect("an output directory");
    let writer = FieldWriter::new(&frame, Vec::new(), &[FieldKind::Svg]);
    let mut recorder = Recorder::writing_to(Some(output)).with_fields(writer);
    for (name, cycles) in [("indent <&>", 0), ("shift", 0), ("fretting", 50_000), ("fretting", 100_000)] {
        let record = IncrementRecord {
            name: name.into(),
            normal_force: 290.0,
            tangential_force: [30.0 + cycles as f64 / 1e3, -1.0],
            contact_area: 3.1,
            worn_volume: 1e-7 * cycles as f64,
            cycles_done: cycles,
            ..Default::default()
        };
        recorder.increment_done(&record, &state).expect("kept");
    }
    let mut summary = Summary::new("", "", Units::default());
    summary.set_outcome(&Ok(Outcome::Converged));
    recorder.finish(&mut summary).expect("written results");
    let pictures = ["pressure.svg", "zones.svg", "profiles.svg", "history.svg"];
    assert_eq!(summary.files, [&pictures[..], &["history.csv"]].concat());
    if let Some(folder) = std::env::var_os("ORTHOWEAR_KEEP_PICTURES") {
        for name in pictures {
            std::fs::copy(dir.path().join(name), Path::new(&folder).join(name)).expect("a kept picture");
        }
    }
    for name in pictures {
        let size = std::fs::metadata(dir.path().join(name)).expect("a picture").len();
        assert!(size < 4 << 20, "{name} has {size} bytes");
    }
    let Some(python) = python() else { return };
    let parse = "import sys, xml.dom.minidom as m; [m.parse(f) for f in sys.argv[1:]]";
    let files = pictures.map(|name| dir.path().join(name));
    let output = Command::new(python).args(["-c", parse]).args(files).output().expect("Python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
