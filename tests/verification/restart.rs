//! Compares runs that resume from checkpoints with the uninterrupted run.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orthowear::error::Result;
use orthowear::evolution::observer::{CheckpointEvent, Observer};
use orthowear::evolution::records::{FrameState, IncrementRecord};
use orthowear::evolution::{RunCheckpoint, RunResult};
use orthowear::flexibility::Flexibility;
use orthowear::flexibility::operator_history::OperatorHistory;
use orthowear::frame::ContactFrame;
use orthowear::output::checkpoint;
use orthowear::output::provenance::Provenance;
use orthowear::scene::Plan;
use orthowear::simulation::{Simulation, build_with};

use crate::common::usual_or_finest;

/// Observer that writes each checkpoint to a folder of its own and stores all states.
struct Keeping<'a> {
    operator: &'a dyn Flexibility,
    folder: &'a Path,
    checkpoints: usize,
    states: Vec<FrameState>,
}

impl Observer for Keeping<'_> {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, state: &FrameState) -> Result<()> {
        self.states.push(state.clone());
        Ok(())
    }

    fn on_checkpoint(&mut self, _: CheckpointEvent, snapshot: &dyn Fn() -> RunCheckpoint) -> Result<()> {
        let folder = self.folder.join(self.checkpoints.to_string());
        fs::create_dir(&folder).expect("a folder");
        self.checkpoints += 1;
        checkpoint::write(&folder, 1, &origin(), &(snapshot(), self.operator.history()))
    }
}

fn origin() -> Provenance {
    Provenance::new(serde_json::Value::Null, Vec::new())
}

/// All results that the scene determines: records and messages as text, states as bits. Computing times are left out.
#[derive(PartialEq)]
struct Outcome {
    records: Vec<String>,
    rest: String,
    states: Vec<Vec<u64>>,
}

impl Outcome {
    fn new(result: &RunResult, states: &[FrameState]) -> Self {
        let records = result.records.iter().map(|record| {
            let record = IncrementRecord { seconds: 0.0, ..record.clone() };
            serde_json::to_string(&record).expect("finite numbers")
        });
        let bits = |state: &FrameState| {
            let numbers =
                [&state.tractions, &state.gap, &state.slip, &state.wear_depth].into_iter().flatten();
            numbers.map(|value| value.to_bits()).chain(state.status.iter().map(|&s| s.into())).collect()
        };
        Self {
            records: records.collect(),
            rest: format!("{:?} {:?} {:?}", result.outcome, result.skipped, result.warnings),
            states: states.iter().map(bits).collect(),
        }
    }

    #[track_caller]
    fn assert_ends_as(&self, whole: &Self, place: &str) {
        for (i, (found, expected)) in self.records.iter().zip(&whole.records).enumerate() {
            assert_eq!(found, expected, "{place}: entry {i}");
        }
        assert_eq!(self.records.len(), whole.records.len(), "{place}");
        assert_eq!(self.rest, whole.rest, "{place}");
        let later = &whole.states[whole.states.len() - self.states.len()..];
        for (i, (found, expected)) in self.states.iter().zip(later).enumerate() {
            assert!(found == expected, "{place}: state {i} after the checkpoint differs");
        }
    }
}

/// Runs `plan` from the checkpoint `from`, or from the start. Writes checkpoints into `folder`, and returns the results and the
/// number of checkpoints.
fn run(
    plan: &Plan,
    frame: Option<&ContactFrame>,
    (from, threads): (Option<&Path>, usize),
    folder: &Path,
) -> (Outcome, usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        let study = build_with(plan, frame, [None, None], &mut |_| {}, &AtomicBool::new(false));
        let study: Simulation = study.expect("a study");
        let operator = study.model().flexibility.as_ref();
        let from: Option<(RunCheckpoint, OperatorHistory)> = from.map(|from| {
            let found = checkpoint::read(from).expect("a checkpoint").expect("a checkpoint");
            found.state().expect("a state")
        });
        let from = from.as_ref().map(|(snapshot, course)| (snapshot.clone(), course));
        let mut keeping = Keeping { operator, folder, checkpoints: 0, states: Vec::new() };
        let result = study.run_from(from, &mut keeping).expect("a run");
        (Outcome::new(&result, &keeping.states), keeping.checkpoints)
    })
}

/// Asserts that runs resumed from each checkpoint end with the results of the uninterrupted run. If a resumed run writes
/// checkpoints, a further run resumes from the middle one of these.
fn check(scene: &str, frame: Option<&ContactFrame>) {
    check_every(1, scene, frame);
}

/// Like [`check`], but resumes only from every `nth` checkpoint.
fn check_every(nth: usize, scene: &str, frame: Option<&ContactFrame>) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, scene).expect("a written file");
    let plan = orthowear::scene::read(&path, &[]).unwrap_or_else(|m| panic!("{:?}", m.to_error()));
    let place = |name: String| {
        let place = folder.path().join(name);
        fs::create_dir(&place).expect("a folder");
        place
    };
    let first = place("first".to_owned());
    let (whole, checkpoints) = run(&plan, frame, (None, 2), &first);
    assert!(whole.rest.starts_with("Converged"), "{}", whole.rest);
    assert!(checkpoints >= whole.records.len(), "{checkpoints} checkpoints");
    for (taken, k) in (0..checkpoints).step_by(nth).enumerate() {
        let (from, second) = (first.join(k.to_string()), place(format!("from-{k}")));
        let (end, more) = run(&plan, frame, (Some(&from), 1 + (taken + 2) % 3), &second);
        end.assert_ends_as(&whole, &format!("from checkpoint {k}"));
        if more > 0 {
            let (from, third) = (second.join((more / 2).to_string()), place(format!("chain-{k}")));
            let (end, _) = run(&plan, frame, (Some(&from), 1), &third);
            end.assert_ends_as(&whole, &format!("from a checkpoint of the run from checkpoint {k}"));
        }
    }
}

const MATERIALS: &str = r#"
[materials.cfrp]
model = "transversely-isotropic"
E1 = 167230.0
E2 = 9544.0
G12 = 5292.0
nu12 = 0.272
nu23 = 0.37
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "coulomb"
mu = 0.4
[wear]
law = "archard"
i = 2.0e-8
[output]
fields = []
"#;

fn half_spaces(frame: &str, steps: &str) -> String {
    format!(
        "{MATERIALS}\n[body1]\nkind = \"half-space\"\nmaterial = \"cfrp\"\nfibre = {{ tilt = 30.0 }}\n\
         [body2]\nkind = \"half-space\"\nmaterial = \"steel\"\n[frame]\nkind = \"grid\"\n{frame}\n{steps}"
    )
}

/// Truth: the uninterrupted run, to the last bit (case `rel-restart-equals-continuous` of docs/verification.md). Runs resume from
/// every checkpoint, from checkpoints of resumed runs, and with other numbers of threads. The frame is so large that the solver
/// uses windows.
#[test]
#[ignore = "97 s; usual: cycles_and_sliding_of_all_kinds and windows_that_shrink"]
fn loads_and_cycles_of_half_spaces() {
    let steps = r#"
[[steps]]
name = "press"
normal_force = 250.0
increments = 3
[[steps]]
name = "push"
tangential_force = [40.0, 10.0]
increments = 3
[[steps]]
name = "fret"
cycles = { count = 3000, amplitude = 0.004, angle = 20.0, jumps = 3 }
[[steps]]
name = "back"
shift = { distance = 0.0, angle = 0.0 }
increments = 2
wear = false
"#;
    check(&half_spaces("half_width = [1.5, 1.5]\ncells = [64, 64]", steps), None);
}

/// Truth: the uninterrupted run.
#[test]
fn cycles_and_sliding_of_all_kinds() {
    let steps = r#"
[[steps]]
name = "press"
normal_force = 250.0
[[steps]]
name = "fret"
normal_force = 200.0
cycles = { count = 20000, amplitude = 0.004, angle = 20.0 }
[[steps]]
name = "round"
cycles = { count = 200, amplitude = 0.003, amplitude2 = 0.002, path = "ellipse", increments = 3, jumps = 2 }
[[steps]]
name = "shake"
cycles = { count = 500, force_amplitude = 20.0, increments = 2, jumps = 2 }
[[steps]]
name = "resolve"
cycles = { count = 4000, amplitude = 0.006, increments = "auto", jumps = 3 }
[[steps]]
name = "slide"
sliding = { distance = 20.0, angle = 30.0 }
[[steps]]
name = "back"
shift = { distance = 0.0, angle = 0.0 }
"#;
    check_every(
        usual_or_finest(5, 1),
        &half_spaces("half_width = [1.5, 1.5]\ncells = [16, 16]", steps),
        None,
    );
}

/// Truth: the uninterrupted run. The contact shrinks during the release, so that the solver uses smaller windows.
#[test]
fn windows_that_shrink() {
    let steps = r#"
[[steps]]
name = "press"
normal_force = 300.0
increments = 2
[[steps]]
name = "release"
normal_force = 200.0
increments = 5
"#;
    check(&half_spaces("half_width = [1.5, 1.5]\ncells = [96, 96]", steps), None);
}

/// Truth: the uninterrupted run. Pressures alone cause tangential displacements of the surfaces.
#[test]
fn sliding_without_friction() {
    let steps = r#"
[[steps]]
name = "press"
normal_force = 250.0
[[steps]]
name = "push"
shift = { distance = 0.01, angle = 30.0 }
[[steps]]
name = "slide"
sliding = { distance = 20.0, angle = 30.0, jumps = 4 }
"#;
    let scene = half_spaces("half_width = [1.5, 1.5]\ncells = [16, 16]", steps);
    let law = "law = \"coulomb\"\nmu = 0.4";
    assert!(scene.contains(law));
    let scene = scene.replace(law, "law = \"none\"");
    let wear = "i = 2.0e-8";
    for integrator in ["backward-euler", "sdirk2"] {
        check(&scene.replace(wear, &format!("{wear}\nintegrator = \"{integrator}\"")), None);
    }
}

/// Truth: the uninterrupted run. Wear volume and rolled distance accumulate from increment to increment.
#[test]
fn rolling() {
    let steps = r#"
[[steps]]
name = "press"
normal_force = 250.0
[[steps]]
name = "roll"
rolling = { direction = 0.0, creepage = [0.001, 0.0005], spin = 0.0, distance = 10.0 }
increments = 3
"#;
    check(&half_spaces("half_width = [1.2, 1.2]\ncells = [24, 24]", steps), None);
}

/// Truth: the uninterrupted run.
#[test]
fn turns() {
    let steps = r#"
[[steps]]
name = "press"
normal_force = 250.0
increments = 2
[[steps]]
name = "tip"
moment = [10.0, 0.0]
twist = 0.02
increments = 3
[[steps]]
name = "release"
moment = [0.0, 0.0]
normal_force = 100.0
increments = 2
"#;
    check(&half_spaces("half_width = [1.4, 1.4]\ncells = [20, 20]", steps), None);
}

/// Truth: the uninterrupted run. At the start, the flexibility is known only for the middle cells. As the contact grows, the run
/// computes the flexibility of further cells.
#[test]
fn growing_contact_of_a_meshed_body() {
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/cfrp-block-coarse.msh");
    let scene = format!(
        r#"{MATERIALS}
[body1]
kind = "fe"
material = "cfrp"
fibre = {{ tilt = 30.0 }}
mesh = '{}'
contact = "contact"
fixed = [{{ group = "base" }}]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [8, 8]
[[steps]]
name = "press"
normal_force = 300.0
increments = 4
[[steps]]
name = "fret"
cycles = {{ count = 2000, amplitude = 0.01, angle = 20.0, jumps = 2 }}
[[steps]]
name = "release"
normal_force = 200.0
increments = 2
"#,
        mesh.display()
    );
    let mut frame = ContactFrame::grid([1.2, 1.2], [8, 8], [0.0, 0.0], 0.0).expect("a frame");
    let near = |cell| frame.plane_coordinates(cell).iter().map(|x| x * x).sum::<f64>() < 0.1;
    frame.candidates = Some((0..frame.n_cells()).map(near).collect());
    // Each run condenses the body again, which takes time. The test therefore resumes only from every n-th checkpoint.
    check_every(usual_or_finest(6, 2), &scene, Some(&frame));
}
