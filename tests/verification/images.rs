//! A run that is the image of another one is made of it only where bodies, laws and gap are images.

use std::fs;
use std::sync::atomic::AtomicBool;

use orthowear::error::Result;
use orthowear::evolution::RunResult;
use orthowear::evolution::image::{Entries, Recording};
use orthowear::evolution::records::{FrameState, IncrementRecord, Observer, Outcome};
use orthowear::geometry::GridSymmetry;
use orthowear::simulation::build;

const SCENE: &str = r#"
[materials.cfrp]
model = "transversely-isotropic"
E1 = 139e3
E2 = 8.7e3
nu12 = 0.32
nu23 = 0.369
G12 = 4.5e3
[body1]
kind = "half-space"
material = "cfrp"
fibre = { azimuth = 20.0, tilt = 30.0 }
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.1, 0.9]
cells = [12, 10]
[gap]
kind = "sphere"
radius = 50.0
offset = [0.0, 0.1]
[friction]
law = "elliptic"
mu1 = 0.5
mu2 = 0.3
angle = 10.0
[wear]
law = "archard"
i = 1e-8
[[steps]]
name = "indent"
approach = 0.01
[[steps]]
name = "shift"
shift = { distance = 0.02, angle = 35.0 }
"#;

/// Mirrored: y to -y.
const IMAGE: [(&str, &str); 4] = [
    ("azimuth = 20.0", "azimuth = -20.0"),
    ("offset = [0.0, 0.1]", "offset = [0.0, -0.1]"),
    ("angle = 10.0", "angle = -10.0"),
    ("angle = 35.0", "angle = -35.0"),
];

/// Keeps what it hears.
struct Hearing {
    kept: Entries,
    entries: Vec<(IncrementRecord, FrameState)>,
    /// After so many entries it wants the run to end.
    most: usize,
}

impl Hearing {
    fn new(bytes: usize) -> Self {
        Self { kept: Entries::up_to(bytes), entries: Vec::new(), most: usize::MAX }
    }
}

impl Observer for Hearing {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        self.kept.add(record, state);
        self.entries.push((record.clone(), state.clone()));
        Ok(())
    }

    fn cancelled(&self) -> bool {
        self.entries.len() >= self.most
    }
}

/// Does something with the study of the scene with changes.
fn with<T>(changes: &[(&str, &str)], work: impl FnOnce(&orthowear::simulation::Simulation<'_>) -> T) -> T {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    let scene = changes.iter().fold(SCENE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    fs::write(&path, scene).expect("a written file");
    let plan = orthowear::scene::read(&path, &[]).unwrap_or_else(|m| panic!("{:?}", m.to_error()));
    let study = build(&plan, &mut |_| {}, &AtomicBool::new(false)).ok().flatten().expect("a study");
    work(&study)
}

fn record(bytes: usize) -> (Option<Recording>, RunResult) {
    with(&[], |study| {
        let mut hearing = Hearing::new(bytes);
        let result = study.run(&mut hearing).expect("a run");
        assert_eq!(result.outcome, Outcome::Converged);
        (Recording::new(study.model(), &result, hearing.kept), result)
    })
}

/// Truth: the run by itself, force by force and traction by traction, to what the tolerance of 1e-8 leaves. Of a scene in which one thing is no image,
/// be it known to the operator, the laws or the gap alone, nothing is delivered.
#[test]
fn images_are_delivered_where_all_is_one() {
    let (recording, _) = record(1 << 30);
    let recording = recording.expect("a recording");
    let mirror = GridSymmetry::ALL[1];
    assert_eq!(mirror.apply([1.0, 2.0]), [1.0, -2.0]);
    let deliver = |changes: &[(&str, &str)], symmetry: GridSymmetry| {
        with(changes, |study| {
            let mut hearing = Hearing::new(0);
            let result = recording.deliver_image(study.model(), symmetry, &mut hearing);
            (result.expect("no file is written"), hearing.entries)
        })
    };
    let (image, heard) = deliver(&IMAGE, mirror);
    let image = image.expect("an image");
    let alone = with(&IMAGE, |study| {
        let mut hearing = Hearing::new(0);
        study.run(&mut hearing).expect("a run");
        hearing.entries
    });
    assert_eq!((image.records.len(), heard.len()), (2, alone.len()));
    for ((record, state), (own, expected)) in heard.iter().zip(&alone) {
        let force = own.normal_force;
        assert!((record.normal_force - force).abs() < 1e-6 * force);
        for (found, wanted) in record.tangential_force.iter().zip(own.tangential_force) {
            assert!((found - wanted).abs() < 1e-6 * force, "{found} {wanted}");
        }
        for (found, wanted) in record.moment.iter().zip(own.moment) {
            assert!((found - wanted).abs() < 1e-6 * force, "{found} {wanted}");
        }
        for (found, wanted) in state.tractions.iter().zip(&expected.tractions) {
            assert!((found - wanted).abs() < 1e-6 * own.peak_pressure, "{found} {wanted}");
        }
        assert_eq!(state.status, expected.status);
    }
    let others = [
        ("tilt = 30.0", "tilt = 31.0"),
        ("G12 = 4.5e3", "G12 = 4.6e3"),
        ("mu2 = 0.3", "mu2 = 0.31"),
        ("law = \"archard\"\ni = 1e-8", "law = \"archard\"\ni = 1.1e-8"),
        ("radius = 50.0", "radius = 51.0"),
        ("cells = [12, 10]", "cells = [10, 12]"),
        ("half_width = [1.1, 0.9]", "half_width = [1.1, 0.91]"),
    ];
    for (number, left_out) in IMAGE.iter().enumerate().take(3) {
        let changes: Vec<_> = IMAGE.iter().filter(|change| *change != left_out).copied().collect();
        let (result, heard) = deliver(&changes, mirror);
        assert!(result.is_none() && heard.is_empty(), "{number}");
    }
    for change in others {
        let (result, heard) = deliver(&[&IMAGE[..], &[change]].concat(), mirror);
        assert!(result.is_none() && heard.is_empty(), "{change:?}");
    }
    for symmetry in GridSymmetry::ALL.into_iter().filter(|symmetry| *symmetry != mirror) {
        assert!(deliver(&IMAGE, symmetry).0.is_none(), "{symmetry:?}");
    }
}

/// Truth: a run that does not fit into the memory, or was interrupted, has no images; one that delivers them hears of a signal.
#[test]
fn parts_of_runs_have_no_images() {
    assert!(record(10_000).0.is_none());
    let (recording, mut result) = record(1 << 30);
    with(&IMAGE, |study| {
        let mut hearing = Hearing::new(0);
        hearing.most = 1;
        let recording = recording.as_ref().expect("a recording");
        let image = recording.deliver_image(study.model(), GridSymmetry::ALL[1], &mut hearing);
        let image = image.expect("no file is written").expect("an image");
        assert_eq!((image.outcome, image.records.len(), hearing.entries.len()), (Outcome::Interrupted, 1, 1));
    });
    result.outcome = Outcome::Interrupted;
    with(&[], |study| {
        assert!(Recording::new(study.model(), &result, Entries::up_to(1 << 30)).is_none());
    });
}
