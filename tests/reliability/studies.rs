//! Mutated study files. Names after "Truth" are cases of docs/verification.md.

use std::fs;

use orthowear::scene::schema::json_schema_of;
use orthowear::sweep;
use orthowear::sweep::spec::StudyFile;

use crate::harness::{Reader, not_finite, put};
use crate::scenes::{self, MATERIALS};

const STUDY: &str = r#"[study]
title = "a study"
scene = "scene.toml"
require = ["tilt + 1e2 * body1.fibre.azimuth <= 45", "0 < (gap.radius - 1) / 2 != -'tilt'"]
[[axes]]
keys = ["body1.fibre.tilt"]
values = [0, 30.0]
[[axes]]
name = "depth"
keys = ["steps.indent.approach", "gap.radius"]
values = [[0.02, 50.0], [0.01, 40.0]]
[[axes]]
zip = "both"
keys = ["body1.fibre.azimuth"]
range = { from = 0, to = 0.3, count = 3, spacing = "linear" }
[[axes]]
zip = "both"
keys = ["frame.half_width.0"]
range = { from = 1, to = 2, step = 0.5 }
[output]
collect = ["indent.normal_force", "indent.tangential_force.0"]
curves = ["indent.worn_volume"]
"#;

/// Truth (rel-no-panics, rel-nan-guard): a study is refused with at least one mistake. Otherwise, each combination of
/// values that is not excluded is a run with its own folder.
#[test]
fn study_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = format!(
        "{MATERIALS}[body1]\nkind = \"half-space\"\nmaterial = \"cfrp\"\nfibre = {{ tilt = 0.0 }}\n[body2]\nkind = \"rigid\"\n\
         [frame]\nkind = \"grid\"\nhalf_width = [1.0, 1.0]\ncells = [4, 4]\n[gap]\nkind = \"sphere\"\nradius = 9.0\n[[steps]]\n\
         name = \"indent\"\napproach = 0.01\n"
    );
    fs::write(folder.path().join("scene.toml"), scene).expect("a file");
    let path = folder.path().join("study.toml");
    let mut words = scenes::words(&json_schema_of::<StudyFile>());
    let more = [
        "steps.indent.normal_force",
        "body1.fibre.azimuth",
        "gap.radius",
        "frame.cells.0",
        "title",
        "..",
        "/",
        "\u{fc}",
    ];
    words.extend(more.map(str::to_owned));
    let reader = Reader { name: "study", read: "a study", seeds: vec![STUDY.into()], words, cases: 6000 };
    reader.check(|bytes| {
        put(&path, bytes);
        let sweep = match sweep::read(&path, &scenes::overrides(bytes)) {
            Ok(sweep) => sweep,
            Err(files) => {
                let first = files.iter().flat_map(|mistakes| &mistakes.list).next();
                return first.expect("refused without a mistake").message.clone();
            }
        };
        let count: usize = sweep.axes.iter().map(|axis| axis.values.len()).product();
        assert_eq!(sweep.runs.len() + sweep.left_out, count);
        assert!(!sweep.runs.is_empty());
        let mut folders: Vec<&str> = sweep.runs.iter().map(|run| run.folder.as_str()).collect();
        assert!(
            folders.iter().all(|name| !name.contains(['/', '\0']) && ![".", ".."].contains(name)),
            "{folders:?}"
        );
        folders.sort_unstable();
        folders.dedup();
        assert_eq!(folders.len(), sweep.runs.len(), "{folders:?}");
        assert_eq!(not_finite(&format!("{:?}", sweep.runs), true), None);
        format!("a study of {} axes", sweep.axes.len())
    });
}
