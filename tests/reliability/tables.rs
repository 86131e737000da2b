//! Mutated table files of scenes: heights, load histories, and material axes of elements. Names after "Truth" are cases
//! of docs/verification.md.

use std::fs;
use std::path::Path;

use orthowear::frame::height_file;
use orthowear::scene;

use crate::harness::{Reader, put};
use crate::scenes::{self, LOADS, MATERIALS};

fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let length = (header.len() as u16).to_le_bytes();
    [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), data].concat()
}

fn words(list: &[&str]) -> Vec<String> {
    list.iter().map(|word| (*word).to_owned()).collect()
}

/// Truth (rel-no-panics, rel-nan-guard): a table of heights is refused with a message. Otherwise, it has as many finite
/// values as its shape requires.
#[test]
fn height_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let values: Vec<u8> = (0..12).flat_map(|i| (0.5 * f64::from(i)).to_le_bytes()).collect();
    let seeds = vec![
        b"1,2.5,3\n-3,4e1,0.1\n".to_vec(),
        b"# heights\n1 2.5\n-3\t40\n".to_vec(),
        b"\"1\";\"2.5\"\n-3;40;\n".to_vec(),
        npy("<f8", "(3, 4)", &values),
        npy("<i4", "(6, 4)", &values),
    ];
    let path = folder.path().join("heights");
    let words =
        words(&["'shape': (", "'descr': '<f4'", "'fortran_order': True", "\x00", ",", ";", "\"", "(1, 12)"]);
    let reader = Reader { name: "heights", read: "", seeds, words, cases: 20_000 };
    reader.check(|bytes| {
        put(&path, bytes);
        match height_file::read(&path) {
            Ok(table) => {
                assert_eq!(table.values.len(), table.shape[0] * table.shape[1]);
                assert!(table.values.iter().all(|value| value.is_finite()) && !table.values.is_empty());
                format!("{} values", table.values.len())
            }
            Err(error) => error.to_string(),
        }
    });
}

fn examine(scene: &Path, table: &Path, bytes: &[u8]) -> String {
    put(table, bytes);
    match scene::read(scene, &[]) {
        Ok(plan) => {
            if let Some(place) = crate::harness::not_finite(&format!("{:?}", scenes::bare(plan)), true) {
                panic!("a plan with a number that is none: {place}");
            }
            "a plan".to_owned()
        }
        Err(mistakes) => {
            assert!(!mistakes.list.is_empty() && mistakes.list.len() < 100);
            mistakes.list[0].message.clone()
        }
    }
}

/// Truth (rel-no-panics, rel-nan-guard): a load history is refused with mistakes. Otherwise, it gives a plan of finite
/// numbers.
#[test]
fn load_histories() {
    let folder = scenes::folder();
    let place = folder.path().join("scenes");
    let scene = format!(
        "{MATERIALS}[body1]\nkind = \"half-space\"\nmaterial = \"cfrp\"\n[body2]\nkind = \"rigid\"\n[frame]\nkind = \"grid\"\n\
         half_width = [1.0, 1.0]\ncells = [4, 4]\n[gap]\nkind = \"sphere\"\nradius = 9.0\n[friction]\nlaw = \"coulomb\"\n\
         mu = 0.3\n[[steps]]\nname = \"load\"\nhistory = {{ file = \"loads.csv\" }}\n"
    );
    let path = place.join("scene.toml");
    fs::write(&path, scene).expect("a file");
    let seeds = vec![
        LOADS.as_bytes().to_vec(),
        b"normal_force;tangential_x;tangential_y;spin_moment\n10;0;0;0\n20;1;0.5;0.1\n".to_vec(),
        b"approach rotation_x rotation_y twist -\n0.01 0 0 0 7\n0.02 0.1 0 0.2 8\n".to_vec(),
    ];
    let words = words(&[
        "approach",
        "normal_force",
        "shift_x",
        "tangential_x",
        "moment_x",
        "moment_y",
        "rotation_x",
        "twist",
        "-",
        ",",
        ";",
        "\n",
    ]);
    let table = place.join("loads.csv");
    Reader { name: "loads", read: "a plan", seeds, words, cases: 1200 }
        .check(|bytes| examine(&path, &table, bytes));
}

/// Truth (rel-no-panics, rel-nan-guard): a table of axes is refused with mistakes. Otherwise, it gives a plan of finite
/// numbers.
#[test]
fn axes_of_elements() {
    let folder = scenes::folder();
    let place = folder.path().join("scenes");
    let path = place.join("scene.toml");
    fs::write(&path, scenes::seeds().pop().expect("a scene")).expect("a file");
    let seeds = vec![scenes::axes().into_bytes()];
    let words = words(&["#", "element,fx,fy,fz", ",", ";", "0,0,0", "\n"]);
    let table = place.join("axes.csv");
    Reader { name: "axes", read: "a plan", seeds, words, cases: 500 }
        .check(|bytes| examine(&path, &table, bytes));
}
